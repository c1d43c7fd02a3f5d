//! Tangents where a file has none: those of MikkTSpace, as the specification of glTF demands (and as baking tools of OBJ have them).

use bevy_mikktspace::{TangentSpace, generate_tangents};
use glam::DVec3;

struct Corners<'a> {
    positions: &'a [DVec3],
    normals: &'a [DVec3],
    uvs: &'a [[f32; 2]],
    tangents: Vec<[DVec3; 2]>,
}

impl bevy_mikktspace::Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.positions.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vertex: usize) -> [f32; 3] {
        self.positions[3 * face + vertex].as_vec3().to_array()
    }

    fn normal(&self, face: usize, vertex: usize) -> [f32; 3] {
        self.normals[3 * face + vertex].as_vec3().to_array()
    }

    /// Ours runs down, that of MikkTSpace up.
    fn tex_coord(&self, face: usize, vertex: usize) -> [f32; 2] {
        let [u, v] = self.uvs[3 * face + vertex];
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vertex: usize) {
        let Some(space) = space else { return };
        let index = 3 * face + vertex;
        let [x, y, z, w] = space.tangent_encoded().map(f64::from);
        let tangent = DVec3::new(x, y, z);
        self.tangents[index] = [tangent, w * self.normals[index].cross(tangent)];
    }
}

/// Tangent and bitangent of each corner of triangles.
pub(super) fn tangents_of(positions: &[DVec3], normals: &[DVec3], uvs: &[[f32; 2]]) -> Vec<[DVec3; 2]> {
    let mut corners = Corners { positions, normals, uvs, tangents: vec![[DVec3::ZERO; 2]; positions.len()] };
    // It fails where there is nothing to do.
    let _ = generate_tangents(&mut corners);
    corners.tangents
}
