//! From the polygons of an OBJ file to a mesh in scene space.

use std::collections::HashMap;
use std::hash::Hash;

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::description::{Mesh, Normals};
use crate::scene::error::SceneError;
use crate::scene::materials::MaterialList;
use crate::scene::model::Model;
use crate::scene::obj::library::resolve_materials;
use crate::scene::obj::model::{Corner, NONE, Obj};
use crate::scene::obj::parse::parse_obj;
use crate::scene::read::Files;
use crate::scene::srgb;
use crate::scene::tangents::tangents_of;
use crate::scene::transform::Placement;
use crate::scene::triangle::has_area;
use crate::scene::unit::unit;

/// How a mesh is to be made of an OBJ file.
pub(in crate::scene) struct MeshRequest {
    pub placement: Placement,
    pub normals: NormalsChoice,
    pub material: MaterialSource,
    pub colors: VertexColors,
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

/// What the colours of vertices are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::scene) enum VertexColors {
    /// Codes of sRGB.
    Srgb,
    Linear,
}

/// Reads an OBJ file as a model. `file` is its name, `files` where its MTL files are.
pub(in crate::scene) fn load(
    bytes: &[u8],
    file: &str,
    files: Files<'_>,
    warnings: &mut Vec<String>,
) -> Result<Model, SceneError> {
    let mut materials = MaterialList::default();
    let request = MeshRequest {
        placement: Placement::default(),
        normals: NormalsChoice::AsInFile,
        material: MaterialSource::Mtl,
        colors: VertexColors::Srgb,
    };
    let mesh = request.build(bytes, file, files, &mut materials, warnings)?;
    let (materials, images) = materials.into_parts();
    Ok(Model { materials, images, meshes: vec![mesh], ..Model::default() })
}

impl MeshRequest {
    /// Makes the mesh. `bytes` is the OBJ file, `file` its name for messages, `files` where its MTL files are.
    pub fn build(
        &self,
        bytes: &[u8],
        file: &str,
        files: Files<'_>,
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
                resolve_materials(&obj, used, file, files, materials, warnings)
            }
        };
        let smooth = match self.normals {
            NormalsChoice::Flat => false,
            NormalsChoice::Smooth => true,
            NormalsChoice::AsInFile => obj.normals.iter().any(|&normal| unit(normal).is_some()),
        };
        let colors = self.linear_colors(&obj, file, warnings);
        let mut source = Source { obj: &obj, positions: &positions, triangles: &triangles, normals: None };
        let mut mesh = Mesh {
            name: file.to_owned(),
            normals: if smooth { Normals::Smooth } else { Normals::Flat },
            degenerate_dropped: degenerate,
            triangle_materials,
            ..Mesh::default()
        };
        if smooth {
            source.normals = Some(source.unit_normals(self.placement.rotation()));
        }
        let has_textures = mesh.triangle_materials.iter().any(|&m| !materials.get(m).textures.is_empty());
        let wants_uvs = has_textures && source.has_uvs();
        if has_textures && !wants_uvs {
            warnings.push(format!("{file}: a material has textures, but no face has texture coordinates (vt)"));
        }
        let needs_tangents: Vec<bool> =
            mesh.triangle_materials.iter().map(|&m| materials.get(m).tangent_uv().is_some()).collect();
        let vertices = if wants_uvs && needs_tangents.contains(&true) {
            let frames = source.tangents(&needs_tangents);
            let corner =
                |index: usize| (source.masked(source.corner(index), true), frames[index].map(|v| v.map(f32::to_bits)));
            let (vertices, numbers) = number(3 * triangles.len(), corner);
            mesh.triangles = numbers;
            mesh.tangents = vertices.iter().map(|(_, frame)| frame.map(|v| v.map(f32::from_bits))).collect();
            vertices.into_iter().map(|(corner, _)| corner).collect()
        } else if wants_uvs || smooth {
            let (vertices, numbers) =
                number(3 * triangles.len(), |index| source.masked(source.corner(index), wants_uvs));
            mesh.triangles = numbers;
            vertices
        } else {
            let (vertices, numbers) = number_positions(&triangles);
            mesh.triangles = numbers;
            vertices
        };
        mesh.positions = vertices.iter().map(|corner| positions[corner.position as usize]).collect();
        if wants_uvs {
            mesh.uvs[0] = vertices.iter().map(|corner| source.uv(corner)).collect();
        }
        if !colors.is_empty() {
            mesh.colors = vertices.iter().map(|corner| colors[corner.position as usize]).collect();
        }
        if let Some(normals) = &source.normals {
            mesh.vertex_normals = vertices.iter().map(|corner| normals.of(corner)).collect();
            let is_lost = |corner: &&Corner| corner.normal != NONE && normals.given(corner).is_none();
            let lost = vertices.iter().filter(is_lost).count();
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

    /// Colours of the file's positions; empty if it has none.
    fn linear_colors(&self, obj: &Obj, file: &str, warnings: &mut Vec<String>) -> Vec<[f32; 4]> {
        let is_beyond = |color: &&[f32; 3]| color.iter().any(|x| !(0.0..=1.0).contains(x));
        let beyond = obj.colors.iter().filter(is_beyond).count();
        if beyond > 0 {
            warnings.push(format!(
                "{file}: {beyond} vertices have a colour that is not of numbers from 0 to 1: it is clamped"
            ));
        }
        let linear = |code: f32| match self.colors {
            VertexColors::Srgb => srgb::decode(f64::from(code.clamp(0.0, 1.0))) as f32,
            VertexColors::Linear => code.clamp(0.0, 1.0),
        };
        obj.colors.par_iter().map(|&[r, g, b]| [linear(r), linear(g), linear(b), 1.0]).collect()
    }
}

/// What a mesh is made of.
struct Source<'a> {
    obj: &'a Obj,
    /// In scene space.
    positions: &'a [DVec3],
    triangles: &'a [FileTriangle],
    normals: Option<UnitNormals>,
}

/// Normals in scene space.
struct UnitNormals {
    /// Of the file, where they have a direction.
    given: Vec<Option<DVec3>>,
    /// Of positions, for corners without one.
    generated: Vec<DVec3>,
}

impl UnitNormals {
    fn given(&self, corner: &Corner) -> Option<DVec3> {
        self.given.get(corner.normal as usize).copied().flatten()
    }

    fn of(&self, corner: &Corner) -> DVec3 {
        self.given(corner).unwrap_or_else(|| self.generated[corner.position as usize])
    }
}

impl Source<'_> {
    fn unit_normals(&self, rotation: glam::DMat3) -> UnitNormals {
        UnitNormals {
            given: self.obj.normals.par_iter().map(|&normal| unit(rotation * normal)).collect(),
            generated: area_weighted_normals(self.triangles, self.positions),
        }
    }

    fn corner(&self, index: usize) -> Corner {
        self.triangles[index / 3].corners[index % 3]
    }

    /// The corner without what does not matter.
    fn masked(&self, corner: Corner, has_uvs: bool) -> Corner {
        let uv = if has_uvs { corner.uv } else { NONE };
        let normal = if self.normals.is_some() { corner.normal } else { NONE };
        Corner { uv, normal, ..corner }
    }

    fn has_uvs(&self) -> bool {
        self.triangles.iter().flat_map(|triangle| &triangle.corners).any(|corner| corner.uv != NONE)
    }

    /// Coordinates whose v runs down. (That of OBJ runs up.)
    fn uv(&self, corner: &Corner) -> [f32; 2] {
        let [u, v] = self.obj.uvs.get(corner.uv as usize).copied().unwrap_or_default();
        [u, 1.0 - v]
    }

    /// Tangent and bitangent of all corners; zero for those of triangles that need none.
    fn tangents(&self, needs_them: &[bool]) -> Vec<[[f32; 3]; 2]> {
        let wanted: Vec<usize> = (0..self.triangles.len()).filter(|&triangle| needs_them[triangle]).collect();
        let corners: Vec<Corner> = wanted.iter().flat_map(|&triangle| self.triangles[triangle].corners).collect();
        let positions: Vec<DVec3> = corners.iter().map(|corner| self.positions[corner.position as usize]).collect();
        let normals: Vec<DVec3> = match &self.normals {
            Some(normals) => corners.iter().map(|corner| normals.of(corner)).collect(),
            None => {
                let flat = |[a, b, c]: &[DVec3; 3]| [unit((b - a).cross(c - a)).unwrap_or(DVec3::Z); 3];
                positions.as_chunks().0.iter().flat_map(flat).collect()
            }
        };
        let uvs: Vec<[f32; 2]> = corners.iter().map(|corner| self.uv(corner)).collect();
        let mut frames = vec![[[0.0; 3]; 2]; 3 * self.triangles.len()];
        let found = tangents_of(&positions, &normals, &uvs);
        for (triangle, of_corners) in wanted.into_iter().zip(found.as_chunks::<3>().0) {
            let frame = of_corners.map(|two| two.map(|v| v.normalize_or_zero().as_vec3().to_array()));
            frames[3 * triangle..][..3].copy_from_slice(&frame);
        }
        frames
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

/// Numbers the vertices of the mesh: one for each value that corners have. Returns the value of each vertex, and the vertices of each
/// triangle.
fn number<K: Copy + Eq + Hash>(corners: usize, value: impl Fn(usize) -> K) -> (Vec<K>, Vec<[u32; 3]>) {
    let mut values = Vec::new();
    let mut vertex_of_value = HashMap::new();
    let mut vertex = |index: usize| {
        let value = value(index);
        *vertex_of_value.entry(value).or_insert_with(|| {
            values.push(value);
            values.len() as u32 - 1
        })
    };
    let triangles = (0..corners / 3).map(|triangle| [0, 1, 2].map(|corner| vertex(3 * triangle + corner))).collect();
    (values, triangles)
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
            corners.push(Corner { normal: NONE, uv: NONE, ..corner });
        }
        *vertex
    };
    let triangles = triangles.iter().map(|triangle| triangle.corners.map(&mut vertex)).collect();
    (corners, triangles)
}
