//! Cutting polygons into triangles.

use earcut::Earcut;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::scene::obj::model::{Corner, Face, Obj};

/// Cuts again the polygons whose triangles around the first corner would overlap or lie outside: those that are not convex, as most
/// of them are. Of four or more corners that lie in no plane, what is seen along their mean normal decides.
pub(super) fn cut_concave(obj: &mut Obj) {
    if obj.faces.len() == obj.triangles.len() {
        return;
    }
    let ends: Vec<usize> = obj
        .faces
        .iter()
        .scan(0, |end, face| {
            *end += face.triangles as usize;
            Some(*end)
        })
        .collect();
    let fan_of = |face: usize| &obj.triangles[ends[face] - obj.faces[face].triangles as usize..ends[face]];
    let concave: Vec<(usize, Vec<[Corner; 3]>)> = (0..obj.faces.len())
        .into_par_iter()
        .filter(|&face| obj.faces[face].triangles > 1)
        .filter_map(|face| Some((face, cut(fan_of(face), &obj.positions)?)))
        .collect();
    let mut from = 0;
    let mut triangles = Vec::new();
    for (face, cut) in concave {
        let fan = obj.faces[face].triangles as usize;
        triangles.extend_from_slice(&obj.triangles[from..ends[face] - fan]);
        from = ends[face];
        obj.faces[face] = Face { triangles: cut.len() as u32, ..obj.faces[face] };
        triangles.extend(cut);
    }
    if from > 0 {
        triangles.extend_from_slice(&obj.triangles[from..]);
        obj.triangles = triangles;
    }
}

/// The triangles of a polygon that is given as a fan around its first corner; `None` if the fan does.
fn cut(fan: &[[Corner; 3]], positions: &[DVec3]) -> Option<Vec<[Corner; 3]>> {
    let place = |corner: &Corner| positions[corner.position as usize];
    let normal_of = |[a, b, c]: &[Corner; 3]| (place(b) - place(a)).cross(place(c) - place(a));
    // The sum over the triangles of any cut (Newell's normal), twice the area long.
    let normal: DVec3 = fan.iter().map(normal_of).sum();
    let along = |triangle: &[Corner; 3]| normal_of(triangle).dot(normal);
    let rounding = 1e-12 * normal.length_squared();
    if normal.length_squared() == 0.0 || fan.iter().all(|triangle| along(triangle) >= -rounding) {
        return None;
    }
    let corners: Vec<Corner> = fan[0][..2].iter().copied().chain(fan.iter().map(|triangle| triangle[2])).collect();
    // Scaled, so that areas of tiny polygons are no zeros.
    let origin = place(&corners[0]);
    let size = corners.iter().map(|corner| (place(corner) - origin).abs().max_element()).fold(0.0, f64::max);
    let (x, y) = normal.normalize().any_orthonormal_pair();
    let flat = |corner: &Corner| {
        let to = (place(corner) - origin) / size;
        DVec2::new(to.dot(x), to.dot(y)).to_array()
    };
    let mut indices: Vec<u32> = Vec::new();
    Earcut::new().earcut(corners.iter().map(flat), &[], &mut indices);
    let triangles: Vec<[Corner; 3]> = indices
        .chunks_exact(3)
        .map(|triangle| {
            let [a, b, c] = [0, 1, 2].map(|i| corners[triangle[i] as usize]);
            // All to the polygon's front.
            if along(&[a, b, c]) < 0.0 { [a, c, b] } else { [a, b, c] }
        })
        .collect();
    (!triangles.is_empty()).then_some(triangles)
}
