//! From the polygons of an OBJ file to a mesh in scene space.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::library::{MaterialOfName, resolve_materials};
use super::parse::{Corner, Face, Obj, parse_obj};
use crate::scene::description::{Mesh, Normals};
use crate::scene::error::SceneError;
use crate::scene::materials::MaterialList;
use crate::scene::transform::Placement;
use crate::scene::triangle::has_area;

/// How a mesh is to be made of an OBJ file.
pub(in crate::scene) struct MeshRequest {
    pub placement: Placement,
    pub normals: NormalsChoice,
    pub material: MaterialSource,
}

/// Which normals shade the mesh.
pub(in crate::scene) enum NormalsChoice {
    Flat,
    Smooth,
    /// Smooth if the file has normals.
    AsInFile,
}

/// Where the surfaces come from.
pub(in crate::scene) enum MaterialSource {
    /// The OBJ file's own MTL files.
    Mtl,
    /// This one, for all faces; MTL files are not read.
    Given(u32),
}

impl MeshRequest {
    /// Makes the mesh. `bytes` is the OBJ file, `file` its name for messages, `base_dir` where its MTL files are.
    pub fn build(
        &self,
        bytes: &[u8],
        file: &str,
        base_dir: Option<&Path>,
        materials: &mut MaterialList,
        warnings: &mut Vec<String>,
    ) -> Result<Mesh, SceneError> {
        let obj = parse_obj(bytes, file)?;
        let mut positions = obj.positions.clone();
        if self.placement != Placement::default() {
            let scene_from_mesh = self.placement.scene_from_mesh();
            positions.iter_mut().for_each(|position| *position = scene_from_mesh(*position));
        }
        let smooth = match self.normals {
            NormalsChoice::Flat => false,
            NormalsChoice::Smooth => true,
            NormalsChoice::AsInFile => !obj.normals.is_empty(),
        };
        let triangles = triangulate(&obj, &positions);
        if triangles.kept.is_empty() {
            let (faces, degenerate) = (obj.faces.len(), triangles.degenerate_faces);
            return Err(SceneError::EmptyMesh { file: file.to_owned(), faces, degenerate });
        }
        if triangles.degenerate_faces > 0 {
            let (count, all) = (triangles.degenerate_faces, obj.faces.len());
            warnings.push(format!("{file}: {count} of {all} faces have no area and are dropped"));
        }
        let material_of_name = match self.material {
            MaterialSource::Given(index) => MaterialOfName::all(index),
            MaterialSource::Mtl => {
                let used = triangles.kept.iter().map(|triangle| triangle.material);
                resolve_materials(&obj, used, file, base_dir, materials, warnings)?
            }
        };
        let mut mesh = Mesh {
            name: file.to_owned(),
            positions: Vec::new(),
            vertex_normals: Vec::new(),
            texcoords: Vec::new(),
            triangle_materials: triangles.kept.iter().map(|t| material_of_name.get(t.material)).collect(),
            triangles: Vec::new(),
            normals: if smooth { Normals::Smooth } else { Normals::Flat },
            degenerate_dropped: triangles.degenerate_faces,
        };
        let rotation = self.placement.rotation();
        let generated = if smooth { area_weighted_normals(&triangles.kept, &positions) } else { Vec::new() };
        let normal_of = |corner: Corner| {
            let of_file = obj.normals.get(corner.normal as usize);
            of_file.and_then(|&n| unit(rotation * n)).unwrap_or_else(|| generated[corner.position as usize])
        };
        let has_texcoords = triangles.kept.iter().any(|t| t.corners.iter().any(|c| c.texcoord != Corner::NONE));
        let mut vertices = VertexMap::new(positions.len(), smooth, has_texcoords);
        mesh.triangles = vertices.index(&triangles.kept);
        mesh.positions = vertices.corners.iter().map(|corner| positions[corner.position as usize]).collect();
        if smooth {
            mesh.vertex_normals = vertices.corners.iter().map(|&corner| normal_of(corner)).collect();
        }
        if has_texcoords {
            let texcoord_of = |corner: &Corner| obj.texcoords.get(corner.texcoord as usize).copied();
            mesh.texcoords = vertices.corners.iter().map(|c| texcoord_of(c).unwrap_or(DVec2::ZERO)).collect();
        }
        Ok(mesh)
    }
}

/// A triangle of the file.
struct FileTriangle {
    corners: [Corner; 3],
    material: Option<u32>,
}

struct Triangles {
    kept: Vec<FileTriangle>,
    /// Faces of which nothing was kept.
    degenerate_faces: usize,
}

/// Cuts polygons into fans around their first corner, without triangles that have no area.
fn triangulate(obj: &Obj, positions: &[DVec3]) -> Triangles {
    let mut kept = Vec::with_capacity(obj.corners.len().saturating_sub(2 * obj.faces.len()));
    let mut degenerate_faces = 0;
    for (&Face { material, .. }, polygon) in obj.polygons() {
        let count_before = kept.len();
        for i in 1..polygon.len() - 1 {
            let corners = [polygon[0], polygon[i], polygon[i + 1]];
            let [a, b, c] = corners.map(|corner| positions[corner.position as usize]);
            if has_area(a, b, c) {
                kept.push(FileTriangle { corners, material });
            }
        }
        degenerate_faces += usize::from(kept.len() == count_before);
    }
    Triangles { kept, degenerate_faces }
}

/// A unit normal for each of the file's positions: the mean over the faces around it, each weighted by its area.
/// Where they cancel, that of the last face; where there is no face, zero.
fn area_weighted_normals(triangles: &[FileTriangle], positions: &[DVec3]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    let face_normal = |triangle: &FileTriangle| {
        let [a, b, c] = triangle.corners.map(|corner| positions[corner.position as usize]);
        (b - a).cross(c - a)
    };
    for triangle in triangles {
        let normal = face_normal(triangle);
        triangle.corners.iter().for_each(|corner| sums[corner.position as usize] += normal);
    }
    let mut normals: Vec<DVec3> = sums.into_iter().map(|sum| unit(sum).unwrap_or(DVec3::ZERO)).collect();
    for triangle in triangles {
        for corner in triangle.corners {
            let normal = &mut normals[corner.position as usize];
            if *normal == DVec3::ZERO {
                *normal = unit(face_normal(triangle)).unwrap_or(DVec3::ZERO);
            }
        }
    }
    normals
}

/// Unit vector, also of vectors whose squared length over- or underflows.
fn unit(v: DVec3) -> Option<DVec3> {
    let scale = v.abs().max_element();
    if scale > 0.0 { (v / scale).try_normalize() } else { None }
}

/// Numbers the vertices of the mesh: one for each combination of indices that matters and is used.
struct VertexMap {
    corners: Vec<Corner>,
    /// By position, if nothing but the position matters.
    of_position: Vec<u32>,
    of_corner: HashMap<Corner, u32>,
    normals_matter: bool,
    texcoords_matter: bool,
}

impl VertexMap {
    const UNUSED: u32 = u32::MAX;

    fn new(position_count: usize, normals_matter: bool, texcoords_matter: bool) -> Self {
        let by_position = !normals_matter && !texcoords_matter;
        let of_position = if by_position { vec![Self::UNUSED; position_count] } else { Vec::new() };
        Self { corners: Vec::new(), of_position, of_corner: HashMap::new(), normals_matter, texcoords_matter }
    }

    fn index(&mut self, triangles: &[FileTriangle]) -> Vec<[u32; 3]> {
        triangles.iter().map(|triangle| triangle.corners.map(|corner| self.vertex(corner))).collect()
    }

    fn vertex(&mut self, corner: Corner) -> u32 {
        let key = Corner {
            normal: if self.normals_matter { corner.normal } else { Corner::NONE },
            texcoord: if self.texcoords_matter { corner.texcoord } else { Corner::NONE },
            ..corner
        };
        let next = self.corners.len() as u32;
        let vertex = match self.of_position.get_mut(corner.position as usize) {
            Some(vertex) => vertex,
            None => self.of_corner.entry(key).or_insert(Self::UNUSED),
        };
        if *vertex == Self::UNUSED {
            *vertex = next;
            self.corners.push(key);
        }
        *vertex
    }
}
