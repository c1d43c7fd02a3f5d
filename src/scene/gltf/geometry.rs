//! Primitives of meshes as triangles in world space: morph targets, skins, all kinds of topology, normals and tangents.

use glam::{DMat3, DMat4, DVec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use crate::scene::description::{Mesh, Normals};
use crate::scene::error::SceneError;
use crate::scene::gltf::document::{Document, number};
use crate::scene::tangents::tangents_of;
use crate::scene::transform::cofactors;
use crate::scene::triangle::has_area;

/// The vertices of a primitive in the space of its mesh, and its triangles.
pub(super) struct Geometry {
    positions: Vec<DVec3>,
    /// Empty where the file has none: the primitive is flat.
    normals: Vec<DVec3>,
    /// Tangent, and bitangent.
    tangents: Vec<[DVec3; 2]>,
    uvs: [Vec<[f32; 2]>; 2],
    colors: Vec<[f32; 4]>,
    triangles: Vec<[u32; 3]>,
    /// For each vertex up to eight joints and their weights.
    skin: Vec<Vec<(usize, f64)>>,
    /// For messages.
    name: String,
}

impl Document<'_> {
    /// Reads a primitive, with tangents along a set of texture coordinates if they are needed; `None` if it has no triangles.
    pub fn geometry(
        &self,
        primitive: &Primitive,
        weights: &[f64],
        tangent_uv: Option<usize>,
        at: &str,
    ) -> Result<Option<Geometry>, SceneError> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err(self.error(at, "an unknown mode", "0 to 6"));
        };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            return Ok(None);
        }
        let attribute =
            |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|&index| number(index));
        let Some(index) = attribute(Semantic::Positions) else { return Ok(None) };
        let name = format!("{at}, POSITION");
        const DRACO: &str = "KHR_draco_mesh_compression";
        let has_draco = primitive.extensions.as_ref().is_some_and(|all| all.others.contains_key(DRACO));
        let is_stored = self.root.accessors.get(index).is_some_and(|a| a.buffer_view.is_some() || a.sparse.is_some());
        if has_draco && !is_stored {
            return Err(self.error(at, format!("{DRACO} alone"), "vertices that are stored without it too"));
        }
        let mut positions: Vec<DVec3> = vectors(self.vectors(index, &name, &[Type::Vec3], 0.0)?);
        let count = positions.len();
        let checked = |found: usize, what: &str| match found == count {
            true => Ok(()),
            false => Err(self.error(
                format!("{at}, {what}"),
                format!("{found} elements"),
                format!("{count}, as POSITION has"),
            )),
        };
        let mut normals: Vec<DVec3> = Vec::new();
        if let Some(index) = attribute(Semantic::Normals) {
            normals = vectors(self.vectors(index, &format!("{at}, NORMAL"), &[Type::Vec3], 0.0)?);
            checked(normals.len(), "NORMAL")?;
        }
        let mut tangents: Vec<[f64; 4]> = Vec::new();
        if let (Some(index), false) = (attribute(Semantic::Tangents), normals.is_empty()) {
            tangents = self.vectors(index, &format!("{at}, TANGENT"), &[Type::Vec4], 0.0)?;
            checked(tangents.len(), "TANGENT")?;
        }
        self.add_targets(primitive, weights, &mut positions, &mut normals, &mut tangents, at)?;
        let mut uvs = [Vec::new(), Vec::new()];
        for (set, uvs) in uvs.iter_mut().enumerate() {
            if let Some(index) = attribute(Semantic::TexCoords(set as u32)) {
                let what = format!("TEXCOORD_{set}");
                let read = self.vectors::<2>(index, &format!("{at}, {what}"), &[Type::Vec2], 0.0)?;
                checked(read.len(), &what)?;
                *uvs = read.into_iter().map(|uv| uv.map(|x| if x.is_finite() { x as f32 } else { 0.0 })).collect();
            }
        }
        let mut colors = Vec::new();
        if let Some(index) = attribute(Semantic::Colors(0)) {
            let read = self.vectors::<4>(index, &format!("{at}, COLOR_0"), &[Type::Vec3, Type::Vec4], 1.0)?;
            checked(read.len(), "COLOR_0")?;
            let share = |x: f64| if x.is_finite() { x.clamp(0.0, 1.0) as f32 } else { 1.0 };
            colors = read.into_iter().map(|color| color.map(share)).collect();
        }
        let skin = self.joints_of_vertices(primitive, count, at)?;
        let indices = match primitive.indices {
            Some(index) => self.indices(number(index), &format!("{at}, indices"))?,
            None => (0..count as u32).collect(),
        };
        if let Some(index) = indices.iter().find(|&&index| index as usize >= count) {
            return Err(self.error(format!("{at}, indices"), format!("index {index}"), format!("one below {count}")));
        }
        let triangles = triangles_of(mode, &indices);
        let frames = tangents.iter().zip(&normals).map(|([x, y, z, w], normal)| {
            let tangent = DVec3::new(*x, *y, *z);
            [tangent, *w * normal.cross(tangent)]
        });
        let tangents = frames.collect();
        let name = at.to_owned();
        let mut geometry = Geometry { positions, normals, tangents, uvs, colors, triangles, skin, name };
        match tangent_uv {
            Some(uv_set) if geometry.tangents.is_empty() => geometry.generate_tangents(uv_set),
            Some(_) => {}
            None => geometry.tangents.clear(),
        }
        Ok(Some(geometry))
    }

    /// Adds morph targets by their weights.
    fn add_targets(
        &self,
        primitive: &Primitive,
        weights: &[f64],
        positions: &mut [DVec3],
        normals: &mut [DVec3],
        tangents: &mut [[f64; 4]],
        at: &str,
    ) -> Result<(), SceneError> {
        for (nth, target) in primitive.targets.iter().flatten().enumerate() {
            let weight = weights.get(nth).copied().unwrap_or(0.0);
            if weight == 0.0 {
                continue;
            }
            let at = format!("{at}, target {nth}");
            let read = |index: gltf::json::Index<gltf::json::Accessor>| -> Result<Vec<DVec3>, SceneError> {
                Ok(vectors(self.vectors(number(index), &at, &[Type::Vec3], 0.0)?))
            };
            let add =
                |to: &mut [DVec3], index: Option<gltf::json::Index<gltf::json::Accessor>>| -> Result<(), SceneError> {
                    if let Some(index) = index {
                        to.iter_mut().zip(read(index)?).for_each(|(value, delta)| *value += weight * delta);
                    }
                    Ok(())
                };
            add(positions, target.positions)?;
            add(normals, target.normals)?;
            if let Some(index) = target.tangents {
                for (tangent, delta) in tangents.iter_mut().zip(read(index)?) {
                    (0..3).for_each(|i| tangent[i] += weight * delta[i]);
                }
            }
        }
        Ok(())
    }

    fn joints_of_vertices(
        &self,
        primitive: &Primitive,
        count: usize,
        at: &str,
    ) -> Result<Vec<Vec<(usize, f64)>>, SceneError> {
        let attribute =
            |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|&index| number(index));
        let mut skin = Vec::new();
        for set in 0..2 {
            let (Some(joints), Some(weights)) = (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)))
            else {
                break;
            };
            let joints = self.vectors::<4>(joints, &format!("{at}, JOINTS_{set}"), &[Type::Vec4], 0.0)?;
            let weights = self.vectors::<4>(weights, &format!("{at}, WEIGHTS_{set}"), &[Type::Vec4], 0.0)?;
            if joints.len() != count || weights.len() != count {
                let found = format!("{} joints and {} weights", joints.len(), weights.len());
                return Err(self.error(at, found, format!("{count} of both, as POSITION has")));
            }
            skin.resize(count, Vec::new());
            for (vertex, (joints, weights)) in skin.iter_mut().zip(joints.iter().zip(&weights)) {
                let both = joints.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
                vertex.extend(both.map(|(&joint, &weight)| (joint as usize, weight)));
            }
        }
        Ok(skin)
    }
}

fn vectors(values: Vec<[f64; 3]>) -> Vec<DVec3> {
    values.into_iter().map(DVec3::from).collect()
}

/// The triangles of a list, a strip or a fan of vertices.
fn triangles_of(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            // Every other one has its first two vertices exchanged.
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        Mode::TriangleFan => {
            indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], indices[0]]).collect()
        }
        _ => indices.as_chunks().0.to_vec(),
    }
}

impl Geometry {
    /// Gives every corner of every triangle a vertex of its own, with the tangents of MikkTSpace.
    fn generate_tangents(&mut self, uv_set: usize) {
        let uvs = &self.uvs[uv_set];
        if uvs.is_empty() {
            return;
        }
        let corners: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        let positions: Vec<DVec3> = corners.iter().map(|&i| self.positions[i as usize]).collect();
        let coordinates: Vec<[f32; 2]> = corners.iter().map(|&i| uvs[i as usize]).collect();
        let normals: Vec<DVec3> = if self.normals.is_empty() {
            let flat = |[a, b, c]: [DVec3; 3]| [(b - a).cross(c - a).normalize_or(DVec3::Z); 3];
            positions.as_chunks().0.iter().flat_map(|&corners| flat(corners)).collect()
        } else {
            corners.iter().map(|&i| self.normals[i as usize]).collect()
        };
        self.tangents = tangents_of(&positions, &normals, &coordinates);
        let pick = |index: &u32| *index as usize;
        if !self.normals.is_empty() {
            self.normals = normals;
        }
        self.uvs = [0, 1].map(|set: usize| match self.uvs[set].is_empty() {
            true => Vec::new(),
            false => corners.iter().map(|i| self.uvs[set][pick(i)]).collect(),
        });
        if !self.colors.is_empty() {
            self.colors = corners.iter().map(|i| self.colors[pick(i)]).collect();
        }
        if !self.skin.is_empty() {
            self.skin = corners.iter().map(|i| self.skin[pick(i)].clone()).collect();
        }
        self.positions = positions;
        self.triangles = (0..self.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    }

    /// Bytes that a copy in world space takes, about.
    pub fn placed_bytes(&self) -> u64 {
        (size_of::<Mesh>() + self.positions.len() * 128 + self.triangles.len() * 16) as u64
    }

    /// The mesh in world space; `None` if no triangle has an area. `joints`: of a skin, from the mesh's space to the world.
    pub fn placed(&self, to_world: DMat4, joints: &[DMat4], material: u32) -> Option<Mesh> {
        let matrix_of = |vertex: usize| match self.skin.get(vertex) {
            Some(weighted) if !joints.is_empty() && !weighted.is_empty() => {
                let total: f64 = weighted.iter().map(|(_, weight)| weight).sum();
                let joint =
                    |&(joint, weight): &(usize, f64)| *joints.get(joint).unwrap_or(&DMat4::IDENTITY) * (weight / total);
                weighted.iter().map(joint).fold(DMat4::ZERO, |sum, matrix| sum + matrix)
            }
            _ => to_world,
        };
        let matrices: Vec<DMat4> =
            if joints.is_empty() { vec![to_world] } else { (0..self.positions.len()).map(matrix_of).collect() };
        let matrix = |vertex: usize| &matrices[vertex.min(matrices.len() - 1)];
        let positions: Vec<DVec3> =
            self.positions.iter().enumerate().map(|(i, &p)| matrix(i).transform_point3(p)).collect();
        // What is mirrored is seen from its other side.
        let is_mirrored = joints.is_empty() && to_world.determinant() < 0.0;
        let ordered = |[a, b, c]: [u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
        let corner = |i: u32| positions[i as usize];
        let all = self.triangles.len();
        let is_usable = |&[a, b, c]: &[u32; 3]| {
            let corners = [corner(a), corner(b), corner(c)];
            corners.iter().all(|p| p.is_finite()) && has_area(corners[0], corners[1], corners[2])
        };
        let triangles: Vec<[u32; 3]> = self.triangles.iter().filter(|t| is_usable(t)).map(|&t| ordered(t)).collect();
        if triangles.is_empty() {
            return None;
        }
        let normal = |i: usize| {
            let cofactors = cofactors(DMat3::from_mat4(*matrix(i)));
            let sign = if is_mirrored { -1.0 } else { 1.0 };
            (sign * (cofactors * self.normals[i])).normalize_or_zero()
        };
        let mut normals: Vec<DVec3> = (0..self.normals.len()).map(normal).collect();
        let is_smooth = !normals.is_empty();
        if is_smooth {
            repair(&mut normals, &triangles, &positions);
        }
        let direction = |i: usize, v: DVec3| matrix(i).transform_vector3(v).normalize_or_zero().as_vec3().to_array();
        let frame = |(i, two): (usize, &[DVec3; 2])| two.map(|v| direction(i, v));
        let tangents: Vec<_> = self.tangents.iter().enumerate().map(frame).collect();
        let mut mesh = Mesh {
            name: self.name.clone(),
            positions,
            vertex_normals: normals,
            uvs: self.uvs.clone(),
            tangents,
            colors: self.colors.clone(),
            triangle_materials: vec![material; triangles.len()],
            degenerate_dropped: all - triangles.len(),
            triangles,
            normals: if is_smooth { Normals::Smooth } else { Normals::Flat },
        };
        // What no triangle uses may be anything.
        mesh.positions.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = DVec3::ZERO);
        mesh.tangents
            .as_flattened_mut()
            .as_flattened_mut()
            .iter_mut()
            .filter(|x| !x.is_finite())
            .for_each(|x| *x = 0.0);
        Some(mesh)
    }
}

/// Gives vertices without a normal that of one of their triangles.
fn repair(normals: &mut [DVec3], triangles: &[[u32; 3]], positions: &[DVec3]) {
    if normals.iter().all(|normal| normal.is_normalized()) {
        return;
    }
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        let flat = (b - a).cross(c - a).normalize_or(DVec3::Z);
        for &vertex in triangle {
            let normal = &mut normals[vertex as usize];
            if !normal.is_normalized() {
                *normal = flat;
            }
        }
    }
    normals.iter_mut().filter(|normal| !normal.is_normalized()).for_each(|normal| *normal = DVec3::Z);
}
