//! What leaves hold: a sphere, a triangle, or two triangles with a common edge, which halves the records of a mesh. A ray that
//! visits such a leaf tests both, for little more than one: they have two of four corners in common, and one of five edges.

use glam::Vec3;
use rayon::prelude::*;

use crate::hash::mix;

use crate::accel::aabb::Aabb;
use crate::accel::morton::along_curve;
use crate::accel::primitive::Primitive;

/// Primitives that are near each other, among which triangles look for neighbours.
const CHUNK: usize = 4096;

/// Area of a pair's box, at most, in units of those of both triangles together, which is what it costs to visit them apart.
const MOST_AREA: f32 = 1.0;

/// The same in units of the smaller one's box: rays that pass a triangle at a distance of many times its size may seem to hit it, by
/// rounding.
const MOST_OF_SMALLER: f32 = 6.0;

/// One or two primitives, by their numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leaf {
    /// The one with the lower number.
    pub first: u32,
    /// Its neighbour, or [`Leaf::NONE`].
    pub second: u32,
    /// For how many turns of the corners of either, by which each becomes the next, the first one is not on the common edge.
    pub turns: [u8; 2],
}

impl Leaf {
    /// No primitive.
    pub const NONE: u32 = u32::MAX;

    /// The numbers of its primitives.
    pub fn members(self) -> impl Iterator<Item = u32> {
        [self.first, self.second].into_iter().filter(|&i| i != Self::NONE)
    }
}

/// The leaves of a tree of such primitives, each of which is in one. The result does not depend on the number of threads.
pub fn leaves(primitives: &[Primitive]) -> Vec<Leaf> {
    let boxes: Vec<Aabb> = primitives.par_iter().map(Primitive::extent).collect();
    // Few are all in one chunk.
    let mut order = if boxes.len() > CHUNK { along_curve(&boxes) } else { (0..boxes.len() as u32).collect() };
    let chunks: Vec<Vec<Leaf>> = order
        .par_chunks_mut(CHUNK)
        .map(|chunk| {
            // In the order of the primitives: what is paired depends little on what else there is.
            chunk.sort_unstable();
            pairs(chunk, primitives, &boxes)
        })
        .collect();
    chunks.concat()
}

/// The leaves of some of the primitives: each triangle with the neighbour that goes best with it, of those that are left.
fn pairs(chunk: &[u32], primitives: &[Primitive], boxes: &[Aabb]) -> Vec<Leaf> {
    let triangles: Vec<_> = chunk.iter().map(|&i| Triangle::of(&primitives[i as usize])).collect();
    // Side by side: each is asked for several times, and in memory they are far apart.
    let boxes: Vec<(Aabb, f32)> = chunk.iter().map(|&i| boxes[i as usize]).map(|b| (b, b.half_area())).collect();
    let edges = EdgeTable::of(&triangles);
    let mut taken = vec![false; chunk.len()];
    let mut leaves = Vec::with_capacity(chunk.len());
    for (a, triangle) in triangles.iter().enumerate() {
        if taken[a] {
            continue;
        }
        taken[a] = true;
        let mut best = None;
        let mut least = f32::INFINITY;
        for side in 0..triangle.map_or(0, |_| 3) {
            for (b, other) in edges.opposite(&triangles, a, side).filter(|(b, _)| !taken[*b]) {
                let [(one, area), (two, other_area)] = [boxes[a], boxes[b]];
                let whole = one.union(two).half_area();
                let more = whole / (area + other_area);
                if more <= MOST_AREA && whole <= MOST_OF_SMALLER * area.min(other_area) && more < least {
                    (best, least) = (Some((b, [side, other])), more);
                }
            }
        }
        let Some((b, sides)) = best else {
            leaves.push(Leaf { first: chunk[a], second: Leaf::NONE, turns: [0; 2] });
            continue;
        };
        taken[b] = true;
        // The corner that is not on a side is the one before it.
        let turns = sides.map(|side| (side as u8 + 2) % 3);
        leaves.push(Leaf { first: chunk[a], second: chunk[b], turns });
    }
    leaves
}

/// A triangle's corners, and a number for each that is the same for the same points.
#[derive(Clone, Copy)]
struct Triangle {
    corners: [Vec3; 3],
    hashes: [u32; 3],
}

impl Triangle {
    fn of(primitive: &Primitive) -> Option<Self> {
        let Primitive::Triangle { vertices } = *primitive else { return None };
        let hash =
            |corner: Vec3| (corner.to_array().into_iter().fold(0, |hash, x| mix(hash, x.to_bits())) >> 32) as u32;
        Some(Self { corners: vertices, hashes: vertices.map(hash) })
    }

    /// From a side's first corner to the next.
    fn side(&self, side: usize) -> [Vec3; 2] {
        [self.corners[side], self.corners[(side + 1) % 3]]
    }

    /// A number for the side.
    fn hash(&self, side: usize, backwards: bool) -> usize {
        let (mut from, mut to) = (self.hashes[side], self.hashes[(side + 1) % 3]);
        if backwards {
            (from, to) = (to, from);
        }
        (mix(mix(0, from), to) >> 32) as usize
    }
}

/// The sides of triangles, to be found by their ends: open addressing.
struct EdgeTable {
    /// 3·triangle + side, or [`Leaf::NONE`].
    slots: Vec<u32>,
}

impl EdgeTable {
    fn of(triangles: &[Option<Triangle>]) -> Self {
        // Nearly two thirds of the slots stay free, since all of a run of others is looked at.
        let mut table = Self { slots: vec![Leaf::NONE; (8 * triangles.len()).next_power_of_two()] };
        for (i, triangle) in triangles.iter().enumerate() {
            let Some(triangle) = triangle else { continue };
            for side in 0..3 {
                let mut slot = triangle.hash(side, false) & table.mask();
                while table.slots[slot] != Leaf::NONE {
                    slot = (slot + 1) & table.mask();
                }
                table.slots[slot] = (3 * i + side) as u32;
            }
        }
        table
    }

    fn mask(&self) -> usize {
        self.slots.len() - 1
    }

    /// The triangles on the other side of a side, which runs the other way there, and which of theirs it is.
    fn opposite<'a>(
        &'a self,
        triangles: &'a [Option<Triangle>],
        of: usize,
        side: usize,
    ) -> impl Iterator<Item = (usize, usize)> + 'a {
        let wanted = triangles[of].map(|triangle| (triangle.side(side), triangle.hash(side, true)));
        let first = wanted.map(|(_, hash)| hash & self.mask());
        std::iter::successors(first, |slot| Some((slot + 1) & self.mask()))
            .map(|slot| self.slots[slot])
            .take_while(|&found| found != Leaf::NONE)
            .map(|found| (found as usize / 3, found as usize % 3))
            .filter(move |&(i, side)| {
                let runs = triangles[i].map(|triangle| triangle.side(side));
                runs.zip(wanted).is_some_and(|([from, to], (wanted, _))| [to, from] == wanted)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(vertices: [Vec3; 3]) -> Primitive {
        Primitive::Triangle { vertices }
    }

    /// A wavy square of 2·n² triangles, with corners that begin anywhere, in any order.
    fn square(n: usize) -> Vec<Primitive> {
        let mut random = crate::accel::random_numbers(4);
        let at = |i: usize, j: usize| Vec3::new(i as f32, j as f32, 0.3 * ((i * 7 + j * 3) as f32).sin());
        let mut triangles = Vec::new();
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            for mut corners in [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
            {
                corners.rotate_left((3.0 * random()) as usize);
                triangles.push(triangle(corners));
            }
        }
        for i in (1..triangles.len()).rev() {
            triangles.swap(i, (random() * (i + 1) as f32) as usize);
        }
        triangles
    }

    #[test]
    fn most_triangles_of_a_mesh_share_a_leaf() {
        for n in [1, 2, 10, 100] {
            let triangles = square(n);
            let leaves = leaves(&triangles);
            let mut held = vec![0; triangles.len()];
            leaves.iter().flat_map(|leaf| leaf.members()).for_each(|i| held[i as usize] += 1);
            assert!(held.iter().all(|&n| n == 1));
            let pairs: Vec<_> = leaves.iter().filter(|leaf| leaf.second != Leaf::NONE).collect();
            assert!(pairs.len() * 2 * 10 >= triangles.len() * 9, "{n}: {} of {}", 2 * pairs.len(), triangles.len());
            for leaf in pairs {
                assert!(leaf.first < leaf.second);
                let turned = |i: u32, turns: u8| {
                    let mut corners = Triangle::of(&triangles[i as usize]).unwrap().corners;
                    corners.rotate_left(usize::from(turns));
                    corners
                };
                let [_, v1, v2] = turned(leaf.first, leaf.turns[0]);
                let [v3, to, from] = turned(leaf.second, leaf.turns[1]);
                assert_eq!([to, from], [v2, v1]);
                assert!(v3 != v1 && v3 != v2);
            }
        }
    }

    #[test]
    fn what_does_not_go_together_stays_alone() {
        let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let sphere = Primitive::Sphere { center: a, radius: 1.0 };
        let pairs = |primitives: &[Primitive]| leaves(primitives).iter().filter(|l| l.second != Leaf::NONE).count();
        assert_eq!(pairs(&[triangle([a, b, c]), triangle([a, c, d])]), 1);
        // No common edge; turned over; much smaller; far along their common edge; the same.
        assert_eq!(pairs(&[triangle([a, b, c]), triangle([a, Vec3::Z, d])]), 0);
        assert_eq!(pairs(&[triangle([a, b, c]), triangle([a, d, c])]), 0);
        let far = Vec3::new(-10.0, 10.0, 5.0);
        assert_eq!(pairs(&[triangle([a, b, c]), triangle([a, c, far])]), 0);
        assert_eq!(pairs(&[triangle([a, b, c]), triangle([a, b, c]), sphere]), 0);
        assert_eq!(leaves(&[]), []);
        assert_eq!(leaves(&[sphere])[0], Leaf { first: 0, second: Leaf::NONE, turns: [0; 2] });
    }
}
