//! Boxes in an order in which neighbours are near each other: along Morton's curve (1966).

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use crate::accel::aabb::Aabb;

/// Bits of a cell's number along an axis.
const BITS: u32 = 6;
const CELLS: usize = 1 << (3 * BITS);

/// The numbers of boxes by the cells of a grid in which their middles are, cells in the order of the curve; those of a cell stay in
/// order.
pub(super) fn along_curve(boxes: &[Aabb]) -> Vec<u32> {
    let all = boxes.par_iter().map(|b| Aabb::around([b.centroid()])).reduce(|| Aabb::EMPTY, Aabb::union);
    // Cells are cubes. (All is in one if there is no extent, or one too large for a float.)
    let scale = (1 << BITS) as f32 / (all.hi - all.lo).max_element();
    let scale = if scale.is_finite() { scale } else { 0.0 };
    let cell =
        |b: &Aabb| morton(((b.centroid() - all.lo) * scale).min(Vec3::splat(((1 << BITS) - 1) as f32)).as_uvec3());
    let cells: Vec<u32> = boxes.par_iter().map(cell).collect();
    let mut first = vec![0u32; CELLS + 1];
    for &cell in &cells {
        first[cell as usize + 1] += 1;
    }
    for cell in 0..CELLS {
        first[cell + 1] += first[cell];
    }
    let mut order = vec![0; boxes.len()];
    for (i, &cell) in cells.iter().enumerate() {
        let next = &mut first[cell as usize];
        order[*next as usize] = i as u32;
        *next += 1;
    }
    order
}

/// The bits of the three coordinates of a cell, by turns.
fn morton(cell: UVec3) -> u32 {
    let spread = |x: u32| (0..BITS).fold(0, |spread, bit| spread | (x >> bit & 1) << (3 * bit));
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_boxes_are_in_the_order_once() {
        let mut random = crate::accel::random_numbers(7);
        let mut point = || Vec3::new(random(), random(), random());
        let mut boxes: Vec<_> = (0..5000).map(|_| Aabb::around([point()])).collect();
        let far = |boxes: &[Aabb], order: &[u32]| -> f32 {
            order.windows(2).map(|w| boxes[w[0] as usize].lo.distance(boxes[w[1] as usize].lo)).sum()
        };
        let order = along_curve(&boxes);
        let as_they_are: Vec<u32> = (0..5000).collect();
        assert!(far(&boxes, &order) < 0.2 * far(&boxes, &as_they_are));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, as_they_are);
        // Without extent, and beyond all floats.
        assert_eq!(along_curve(&boxes[..1]), [0]);
        assert_eq!(along_curve(&[boxes[0]; 3]), [0, 1, 2]);
        boxes.push(Aabb::around([Vec3::MAX]));
        boxes.push(Aabb::around([Vec3::MIN]));
        assert_eq!(along_curve(&boxes).len(), 5002);
        assert!(along_curve(&[]).is_empty());
        assert_eq!(morton(UVec3::new(0b11, 0b01, 0b10)), 0b101_011);
    }
}
