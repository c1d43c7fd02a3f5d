//! From the polygons of an OBJ file to a mesh in scene space.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::description::{Mesh, Normals};
use crate::scene::error::SceneError;
use crate::scene::materials::MaterialList;
use crate::scene::obj::library::resolve_materials;
use crate::scene::obj::model::{Corner, NONE, Obj};
use crate::scene::obj::parse::parse_obj;
use crate::scene::transform::Placement;
use crate::scene::triangle::has_area;
use crate::scene::unit::unit;

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
        let mut obj = parse_obj(bytes, file)?;
        let mut positions = std::mem::take(&mut obj.positions);
        if self.placement != Placement::default() {
            let scene_from_mesh = self.placement.scene_from_mesh();
            positions.par_iter_mut().for_each(|position| *position = scene_from_mesh(*position));
        }
        let (triangles, degenerate) = with_area(&obj, &positions);
        let faces = obj.faces.len();
        if triangles.is_empty() {
            let placed = match self.placement == Placement::default() {
                true if faces == 0 && positions.is_empty() => ", and no vertex either (is it an OBJ file?)",
                true => "",
                false => " after scale, rotate and translate",
            };
            return Err(SceneError::EmptyMesh { file: file.to_owned(), faces, degenerate, placed });
        }
        if degenerate > 0 {
            warnings.push(format!("{file}: {degenerate} of {faces} faces have no area and are dropped"));
        }
        let triangle_materials = match self.material {
            MaterialSource::Given(index) => vec![index; triangles.len()],
            MaterialSource::Mtl => {
                let used = triangles.iter().map(|triangle| triangle.material);
                resolve_materials(&obj, used, file, base_dir, materials, warnings)
            }
        };
        let smooth = match self.normals {
            NormalsChoice::Flat => false,
            NormalsChoice::Smooth => true,
            NormalsChoice::AsInFile => obj.normals.iter().any(|&normal| unit(normal).is_some()),
        };
        let (vertices, vertices_of_triangles) = number_vertices(&triangles, smooth);
        let mut mesh = Mesh {
            name: file.to_owned(),
            positions: vertices.iter().map(|corner| positions[corner.position as usize]).collect(),
            vertex_normals: Vec::new(),
            triangle_materials,
            triangles: vertices_of_triangles,
            normals: if smooth { Normals::Smooth } else { Normals::Flat },
            degenerate_dropped: degenerate,
            ..Mesh::default()
        };
        if smooth {
            let rotation = self.placement.rotation();
            let generated = area_weighted_normals(&triangles, &positions);
            let mut lost = 0;
            let normal_of = |corner: &Corner| {
                let given = obj.normals.get(corner.normal as usize).and_then(|&n| unit(rotation * n));
                lost += usize::from(given.is_none() && corner.normal != NONE);
                given.unwrap_or_else(|| generated[corner.position as usize])
            };
            mesh.vertex_normals = vertices.iter().map(normal_of).collect();
            if lost > 0 {
                warnings.push(format!(
                    "{file}: {lost} of {} vertices have a normal that is not in the file, not finite or of length 0: those of the \
                     faces around them are used",
                    vertices.len()
                ));
            }
        }
        Ok(mesh)
    }
}

/// A triangle of the file.
struct FileTriangle {
    corners: [Corner; 3],
    material: Option<u32>,
}

/// The triangles that have an area, and the number of faces that have none.
fn with_area(obj: &Obj, positions: &[DVec3]) -> (Vec<FileTriangle>, usize) {
    let keeps = |corners: &[Corner; 3]| {
        let [a, b, c] = corners.map(|corner| positions[corner.position as usize]);
        has_area(a, b, c)
    };
    let keeps: Vec<bool> = obj.triangles.par_iter().map(keeps).collect();
    let mut kept = Vec::with_capacity(obj.triangles.len());
    let mut degenerate_faces = 0;
    let mut triangles = obj.triangles.iter().zip(keeps);
    for face in &obj.faces {
        let count_before = kept.len();
        let of_face = triangles.by_ref().take(face.triangles as usize).filter(|(_, keeps)| *keeps);
        kept.extend(of_face.map(|(&corners, _)| FileTriangle { corners, material: face.material }));
        degenerate_faces += usize::from(kept.len() == count_before);
    }
    (kept, degenerate_faces)
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

/// Numbers the vertices of the mesh: one for each combination of indices that matters and is used. Returns the indices
/// of each vertex, and the vertices of each triangle.
fn number_vertices(triangles: &[FileTriangle], normals_matter: bool) -> (Vec<Corner>, Vec<[u32; 3]>) {
    if !normals_matter {
        return number_positions(triangles);
    }
    let mut corners = Vec::new();
    let mut vertex_of_corner = HashMap::new();
    let mut vertex = |corner: Corner| {
        *vertex_of_corner.entry(corner).or_insert_with(|| {
            corners.push(corner);
            corners.len() as u32 - 1
        })
    };
    let triangles = triangles.iter().map(|triangle| triangle.corners.map(&mut vertex)).collect();
    (corners, triangles)
}

/// The same where only positions matter, without hashing.
fn number_positions(triangles: &[FileTriangle]) -> (Vec<Corner>, Vec<[u32; 3]>) {
    let positions = || triangles.iter().flat_map(|t| &t.corners).map(|c| c.position as usize);
    let mut vertex_of_position = vec![NONE; positions().max().map_or(0, |p| p + 1)];
    let mut corners = Vec::new();
    let mut vertex = |corner: Corner| {
        let vertex = &mut vertex_of_position[corner.position as usize];
        if *vertex == NONE {
            *vertex = corners.len() as u32;
            corners.push(Corner { normal: NONE, ..corner });
        }
        *vertex
    };
    let triangles = triangles.iter().map(|triangle| triangle.corners.map(&mut vertex)).collect();
    (corners, triangles)
}
