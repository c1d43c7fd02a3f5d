//! The packed tree as the shaders read it: one record of three texels for inner nodes and leaves alike; then, for each record, two
//! numbers of primitives that it holds, which are read once a hit is known.
//!
//! ```text
//! inner node   origin | first child, above INNER;   lo | exponents;            hi | children and their order
//! triangles    v0 | v3.x;                           v1 | v3.y;                 v2 | v3.z
//! sphere       centre | -;                          (radius, -, -) | −2;       -
//! primitives   first, second of a record;   first, second of the next one
//! ```
//! Triangles are v0, v1, v2 and v3, v2, v1, whose corners have been turned for that ([`Leaf`]). If there is only one, v3 is v1,
//! and the other has no area. Those that rays may pass are marked in bits that coordinates below 2 leave free ([`Packed::mark_passable`]).
//!
//! Of an inner node the origin is three floats, the exponents are bytes, and the other words hold a byte for each child
//! (see [`Quantised`]). Its children are consecutive records. The last word has in its lowest four
//! bits which of the four there are, and above, for each octant of directions, three bits: whether the second child of the first
//! pair is to be visited before the other, whether the second pair comes before the first, and the second pair's second
//! child before its other. Octants are numbered by the signs of x, y and z. Bit 31 is 0, which a traversal in any order takes
//! for the order (shaders/lib/intersect/bvh/node.glsl).

use glam::Vec3;
use rayon::prelude::*;

use crate::accel::aabb::Aabb;
use crate::accel::builder::{Child, Tree};
use crate::accel::collapse::{Boxed, Collapse, WIDTH};
use crate::accel::leaf::Leaf;
use crate::accel::primitive::Primitive;
use crate::accel::quantised::Quantised;
use crate::accel::statistics::BvhStatistics;

/// Four numbers of 32 bits.
pub type Texel = [u32; 4];

/// Records that a tree may have: the shader's stack has 25 bits for the index of one.
pub const MAX_RECORDS: usize = 1 << 25;

/// The three texels of a record that a traversal reads.
type Record = [Texel; 3];
/// The primitives that it holds.
type Held = [u32; 2];
/// Bytes of both.
const RECORD_BYTES: usize = size_of::<Record>() + size_of::<Held>();

/// Subtrees with more records than this are packed by a task of their own.
const PARALLEL_ABOVE: usize = 4096;

/// Bits of lower planes that are stored inverted.
const LO_FLIP: u32 = 0x4040_4040;
/// The index of an inner node's first child is beside this: as a float it is negative, and larger than any coordinate (2^125).
pub(super) const INNER: u32 = 0xfe00_0000;
/// Bits of words of inner nodes that mean nothing there, so that none is a subnormal float.
const NOT_SUBNORMAL: u32 = 0x3000_0000;
/// In x and y of a triangle's first or second corner: what rays may pass. It is the highest bit of exponents, of floats from 2 on.
const PASSABLE: u32 = 1 << 30;
/// Beside the radius of a sphere.
const SPHERE: u32 = -2i32 as u32;

fn texel(v: Vec3, w: u32) -> Texel {
    [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w]
}

/// No primitive.
const NO_PRIMITIVES: Held = [Leaf::NONE; 2];

/// The record of a leaf.
fn leaf_record(leaf: Leaf, primitives: &[Primitive]) -> Record {
    let [first_turns, second_turns] = leaf.turns;
    let second = (leaf.second != Leaf::NONE).then(|| primitives[leaf.second as usize]);
    let turned = |vertices: [Vec3; 3], turns: u8| [0, 1, 2].map(|i| vertices[(i + usize::from(turns)) % 3]);
    match primitives[leaf.first as usize] {
        Primitive::Sphere { center, radius } => {
            [texel(center, 0), texel(Vec3::new(radius, 0.0, 0.0), SPHERE), texel(Vec3::ZERO, 0)]
        }
        Primitive::Triangle { vertices } => {
            let [a, b, c] = turned(vertices, first_turns);
            let d = match second {
                Some(Primitive::Triangle { vertices }) => turned(vertices, second_turns)[0],
                _ => b,
            };
            [texel(a, d.x.to_bits()), texel(b, d.y.to_bits()), texel(c, d.z.to_bits())]
        }
    }
}

/// What rays may pass of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Passable {
    /// All of it, from behind.
    pub back: bool,
    /// Parts of it.
    pub alpha: bool,
}

/// A tree as the shaders read it.
#[derive(Debug, Clone, PartialEq)]
pub struct Packed {
    /// Around each child of the root, at most four: they are tested before anything is read.
    pub root_boxes: Vec<Aabb>,
    /// Three texels a record, the root's first, and then half a one for each.
    pub texels: Vec<Texel>,
    /// How many there are.
    pub records: usize,
    /// Figures; the time is for the caller to add.
    pub statistics: BvhStatistics,
}

impl Packed {
    /// A tree that no ray meets: a node without children.
    pub fn nothing() -> Self {
        let mut texels = Self::empty_texels(1);
        texels[0][3] = INNER;
        texels[3] = [Leaf::NONE; 4];
        Self { root_boxes: Vec::new(), texels, records: 1, statistics: BvhStatistics::default() }
    }

    /// Without any texel written; an odd record has half a texel to spare.
    fn empty_texels(records: usize) -> Vec<Texel> {
        vec![[0; 4]; 3 * records + records.div_ceil(2)]
    }

    /// The number of the primitive in a slot, of which each record has two; `None` if there is none.
    pub fn primitive(&self, slot: usize) -> Option<u32> {
        let held = self.texels.get(3 * self.records..)?.as_flattened();
        held.get(slot).copied().filter(|&primitive| primitive != Leaf::NONE)
    }

    /// Marks what rays may pass, by the numbers of primitives. Only triangles are, with coordinates below 2.
    pub fn mark_passable(&mut self, passable: impl Fn(u32) -> Passable) {
        for slot in 0..2 * self.records {
            let Some(Passable { back, alpha }) = self.primitive(slot).map(&passable) else { continue };
            let corner = &mut self.texels[3 * (slot / 2) + slot % 2];
            for (word, _) in corner.iter_mut().zip([back, alpha]).filter(|(_, is_passable)| *is_passable) {
                debug_assert!(*word & PASSABLE == 0, "a coordinate is 2 or more");
                *word |= PASSABLE;
            }
        }
    }
}

/// Packs a tree over leaves and the primitives in these, in four children a node. The primitives are numbered from
/// `first_primitive` on. The result does not depend on the number of threads.
pub fn pack(tree: &Tree, leaves: &[Leaf], primitives: &[Primitive], first_primitive: u32) -> Packed {
    let collapse = Collapse::of(tree);
    let records = collapse.records(0);
    let mut texels = Packed::empty_texels(records);
    let (hot, held) = texels.split_at_mut(3 * records);
    let held = &mut bytemuck::cast_slice_mut::<_, Held>(held)[..records];
    held.fill(NO_PRIMITIVES);
    let (root_record, rest) = bytemuck::cast_slice_mut::<_, Record>(hot).split_at_mut(1);
    let whole = tree.nodes[0].bounds[0].union(tree.nodes[0].bounds[1]);
    let packer = Packer { tree, collapse, leaves, primitives, first_primitive };
    let children = packer.children(0);
    let descendants = Place { first: 1, records: rest, primitives: &mut held[1..] };
    let sums = packer.node(&children, &mut root_record[0], descendants);
    let area = f64::from(whole.half_area());
    Packed {
        root_boxes: children.iter().map(|c| c.0).collect(),
        statistics: BvhStatistics {
            nodes: records - tree.order.len(),
            leaves: tree.order.len(),
            primitives: primitives.len(),
            depth: sums.depth,
            sah_cost: if area > 0.0 { 1.0 + sums.area / area } else { 0.0 },
            bytes: RECORD_BYTES * records,
            build_seconds: 0.0,
        },
        texels,
        records,
    }
}

/// Where the records of a subtree go.
struct Place<'a> {
    /// Index of the first.
    first: usize,
    records: &'a mut [Record],
    primitives: &'a mut [Held],
}

impl<'a> Place<'a> {
    fn split(self, at: usize) -> (Self, Self) {
        let (a, b) = self.records.split_at_mut(at);
        let (c, d) = self.primitives.split_at_mut(at);
        let first = self.first;
        (Self { first, records: a, primitives: c }, Self { first: first + at, records: b, primitives: d })
    }
}

/// Of a subtree: levels below its root, and areas of the boxes there.
#[derive(Clone, Copy, Default)]
struct Sums {
    depth: u32,
    area: f64,
}

struct Packer<'a> {
    tree: &'a Tree,
    collapse: Collapse<'a>,
    leaves: &'a [Leaf],
    primitives: &'a [Primitive],
    first_primitive: u32,
}

impl Packer<'_> {
    /// The children of a node that stays, in the order of their records.
    fn children(&self, node: u32) -> Vec<Boxed> {
        in_pairs(self.collapse.children(node))
    }

    /// Packs a node with these children into `own`, and all that is below it into `place`: the children, then what is below each
    /// of them.
    fn node(&self, children: &[Boxed], own: &mut Record, place: Place) -> Sums {
        *own = inner_record(children, place.first);
        let parallel = place.records.len() > PARALLEL_ABOVE;
        let (own, mut rest) = place.split(children.len());
        let mut below = Vec::with_capacity(WIDTH);
        for (i, (record, &(_, child))) in own.records.iter_mut().zip(children).enumerate() {
            match child {
                Child::Leaf(leaf) => {
                    let leaf = self.leaves[self.tree.order[leaf as usize] as usize];
                    for (number, member) in own.primitives[i].iter_mut().zip(leaf.members()) {
                        *number = self.first_primitive + member;
                    }
                    *record = leaf_record(leaf, self.primitives);
                }
                Child::Inner(node) => {
                    let (subtree, others) = rest.split(self.collapse.records(node) - 1);
                    below.push((node, record, subtree));
                    rest = others;
                }
            }
        }
        let area: f64 = children.iter().map(|(b, _)| f64::from(b.half_area())).sum();
        let pack = |(node, record, place): (u32, _, Place)| self.node(&self.children(node), record, place);
        let add = |a: Sums, b: Sums| Sums { depth: a.depth.max(b.depth), area: a.area + b.area };
        let below = if parallel {
            let sums: Vec<Sums> = below.into_par_iter().map(pack).collect();
            sums.into_iter().fold(Sums::default(), add)
        } else {
            below.into_iter().map(pack).fold(Sums::default(), add)
        };
        Sums { depth: 1 + below.depth, area: area + below.area }
    }
}

/// Puts the two of three children first that are closer together.
fn in_pairs(mut children: Vec<Boxed>) -> Vec<Boxed> {
    if let [a, b, c] = children[..]
        && b.0.union(c.0).half_area() < a.0.union(b.0).half_area()
    {
        children.rotate_left(1);
    }
    children
}

fn inner_record(children: &[Boxed], first: usize) -> Record {
    let q = Quantised::around(children.iter().map(|c| c.0));
    let [x, y, z] = q.origin.map(f32::to_bits);
    let [ex, ey, ez] = q.exponent;
    let exponents = u32::from_le_bytes([ex, ey, ez, 0]) | NOT_SUBNORMAL;
    let present = (1u32 << children.len()) - 1;
    // Lanes at a leaf and lanes at a node do the same arithmetic, and discard what was not meant. The planes, taken for
    // coordinates, must not be subnormal floats, with which most CPUs are a hundred times slower: most are not, if
    // bytes that are most often 0 are not.
    let absent = u32::MAX.checked_shl(8 * children.len() as u32).unwrap_or(0) & 0x3f3f_3f3f;
    let lo = q.lo.map(|planes| (planes ^ LO_FLIP) | absent);
    let hi = q.hi.map(|planes| planes | absent);
    let order = visiting_orders(children);
    [
        [x, y, z, INNER | first as u32],
        [lo[0], lo[1], lo[2], exponents],
        [hi[0], hi[1], hi[2], NOT_SUBNORMAL | order | present],
    ]
}

/// Three bits for each octant, from bit 4 on, see the top of this file: along its diagonal, what is nearer comes first.
fn visiting_orders(children: &[Boxed]) -> u32 {
    let middle = |of: &[Boxed]| of.iter().fold(Aabb::EMPTY, |a, c| a.union(c.0)).centroid();
    let (left, right) = children.split_at(children.len().min(2));
    let middles = |a: &[Boxed], b: &[Boxed]| (!b.is_empty()).then(|| [middle(a), middle(b)]);
    let pair = |pair: &[Boxed]| pair.split_at_checked(1).and_then(|(a, b)| middles(a, b));
    let choices = [pair(left), middles(left, right), pair(right)];
    (0..8).fold(0, |orders, octant| {
        let signs = Vec3::from([0, 1, 2].map(|axis| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 }));
        let swapped = |choice: Option<[Vec3; 2]>| choice.is_some_and(|[a, b]| b.dot(signs) < a.dot(signs));
        choices
            .iter()
            .enumerate()
            .fold(orders, |orders, (bit, &choice)| orders | u32::from(swapped(choice)) << (4 + 3 * octant + bit))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::builder::build;
    use crate::accel::leaf::leaves;

    /// Number of the first primitive.
    const FIRST: u32 = 3;

    fn triangle(corners: [Vec3; 3]) -> Primitive {
        Primitive::Triangle { vertices: corners }
    }

    /// Decodes the tree as the shader does, and finds every primitive once, within the boxes of all nodes above it.
    /// Returns the depth.
    fn check(primitives: &[Primitive]) -> u32 {
        let bounds: Vec<_> = primitives.iter().map(|p| p.bounds(0.0)).collect();
        let leaves = leaves(primitives);
        let of_leaf = |leaf: &Leaf| leaf.members().fold(Aabb::EMPTY, |b, i| b.union(bounds[i as usize]));
        let packed = pack(&build(&leaves.iter().map(of_leaf).collect::<Vec<_>>()).unwrap(), &leaves, primitives, FIRST);
        let records = packed.records;
        assert_eq!(packed.texels.len(), 3 * records + records.div_ceil(2));
        let mut held = vec![0; primitives.len()];
        assert_eq!(packed.statistics.nodes + packed.statistics.leaves, records);
        let mut seen = vec![0; records];
        let mut depth = 0;
        let mut top = Vec::new();
        let mut stack = vec![(0, Vec::<[[f64; 3]; 2]>::new())];
        while let Some((record, above)) = stack.pop() {
            seen[record] += 1;
            let [a, b, c] = [0, 1, 2].map(|i| packed.texels[3 * record + i]);
            let members = [0, 1].map(|second| packed.primitive(2 * record + second));
            for x in [a[3], b[3], c[3]].map(f32::from_bits) {
                assert!(!x.is_subnormal(), "record {record}");
            }
            if a[3] < INNER {
                depth = depth.max(above.len() as u32);
                assert!(members[0].is_some());
                for (second, number) in members.into_iter().enumerate() {
                    let Some(i) = number.map(|number| number - FIRST) else { continue };
                    held[i as usize] += 1;
                    check_member(&primitives[i as usize], &leaves, i, [a, b, c], second == 1);
                    let own = bounds[i as usize];
                    for [lo, hi] in &above {
                        for axis in 0..3 {
                            let (lo, hi) = (lo[axis], hi[axis]);
                            assert!(lo < f64::from(own.lo[axis]) && f64::from(own.hi[axis]) < hi, "leaf {record}");
                        }
                    }
                }
                continue;
            }
            assert_eq!(members, [None; 2]);
            let [ex, ey, ez, _] = b[3].to_le_bytes();
            let q = Quantised {
                origin: [a[0], a[1], a[2]].map(f32::from_bits),
                exponent: [ex, ey, ez],
                lo: [b[0], b[1], b[2]].map(|planes| planes ^ LO_FLIP),
                hi: [c[0], c[1], c[2]],
            };
            let children = (c[3] & 15).trailing_ones();
            assert_eq!(c[3] & 15, (1 << children) - 1);
            for child in 0..children as usize {
                let mut above: Vec<_> = above.clone();
                above.push(q.bounds(child));
                if record == 0 {
                    top.push(q.bounds(child));
                }
                stack.push(((a[3] & !INNER) as usize + child, above));
            }
        }
        assert_eq!(packed.root_boxes.len(), top.len());
        for (own, [lo, hi]) in packed.root_boxes.iter().zip(top) {
            for axis in 0..3 {
                assert!(lo[axis] <= f64::from(own.lo[axis]) && f64::from(own.hi[axis]) <= hi[axis]);
            }
        }
        assert!(seen.iter().chain(&held).all(|&n| n == 1));
        assert_eq!(depth, packed.statistics.depth);
        depth
    }

    /// Decodes a primitive as the shader does.
    fn check_member(primitive: &Primitive, leaves: &[Leaf], number: u32, [a, b, c]: Record, second: bool) {
        let point = |x: u32, y: u32, z: u32| Vec3::from([x, y, z].map(f32::from_bits));
        let [v0, v1, v2] = [a, b, c].map(|texel| point(texel[0], texel[1], texel[2]));
        let corners = if second { [point(a[3], b[3], c[3]), v2, v1] } else { [v0, v1, v2] };
        match *primitive {
            Primitive::Triangle { vertices } => {
                let leaf = leaves.iter().find(|leaf| leaf.members().any(|i| i == number)).unwrap();
                let turns = usize::from(leaf.turns[usize::from(second)]);
                assert_eq!(corners, [0, 1, 2].map(|i| vertices[(i + turns) % 3]));
            }
            Primitive::Sphere { center, radius } => {
                assert_eq!((v0, v1.x, b[3], second), (center, radius, SPHERE, false));
            }
        }
    }

    #[test]
    fn every_primitive_is_within_the_boxes_above_it() {
        let mut random = crate::accel::random_numbers(3);
        let mut point = |size: f32| size * (Vec3::new(random(), random(), random()) - 0.5);
        for n in [1, 2, 3, 4, 5, 6, 17, 100, 20_000] {
            let soup: Vec<Primitive> = (0..n)
                .map(|i| {
                    let center = point(2.0);
                    let size = 10f32.powi(-(i % 7));
                    if i % 11 == 5 {
                        Primitive::Sphere { center, radius: 0.1 * size }
                    } else {
                        triangle([(); 3].map(|()| center + point(size)))
                    }
                })
                .collect();
            let depth = check(&soup);
            assert!(n > 4 || depth == 1, "{n} primitives at depth {depth}");
        }
        // Flat, equal, and so far out that a unit in the last place is larger than they are.
        check(&(0..50).map(|i| triangle([0.0, 1.0, 2.0].map(|x| Vec3::new(x, i as f32, 0.0)))).collect::<Vec<_>>());
        check(&[triangle([Vec3::ZERO, Vec3::X, Vec3::Y]); 9]);
        check(
            &(0..30)
                .map(|i| triangle([Vec3::splat(1e6), Vec3::splat(1e6 + i as f32 / 8.0), Vec3::X]))
                .collect::<Vec<_>>(),
        );
    }

    #[test]
    fn the_same_records_with_any_number_of_threads() {
        let mut random = crate::accel::random_numbers(17);
        let mut point = |size: f32| size * Vec3::new(random(), random(), random());
        let strip = |_| {
            let [a, b, c, d] = [point(1.0), point(0.01), point(0.01), point(0.01)];
            [triangle([a, a + b, a + c]), triangle([a, a + c, a + d])]
        };
        let primitives: Vec<_> = (0..3 * PARALLEL_ABOVE).flat_map(strip).collect();
        let packed = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let leaves = leaves(&primitives);
                let members = |leaf: &Leaf| leaf.members().map(|i| primitives[i as usize].bounds(0.0));
                let boxes: Vec<_> = leaves.iter().map(|leaf| members(leaf).fold(Aabb::EMPTY, Aabb::union)).collect();
                pack(&build(&boxes).unwrap(), &leaves, &primitives, 0)
            })
        };
        assert!(packed(1) == packed(5));
    }

    #[test]
    fn what_rays_may_pass_is_marked() {
        let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::new(-1.5, 1.9, 0.0), Vec3::Y];
        let sphere = Primitive::Sphere { center: 9.0 * Vec3::X, radius: 1.0 };
        let primitives = [triangle([a, b, c]), triangle([a, c, d]), triangle([c, d, Vec3::Z]), sphere];
        let leaves = leaves(&primitives);
        let boxes: Vec<_> = leaves
            .iter()
            .map(|leaf| leaf.members().fold(Aabb::EMPTY, |all, i| all.union(primitives[i as usize].bounds(0.0))))
            .collect();
        let packed = pack(&build(&boxes).unwrap(), &leaves, &primitives, 0);
        let mut marked = packed.clone();
        marked.mark_passable(|i| Passable { back: i == 1, alpha: i < 2 });
        for record in 0..packed.records {
            for (second, corner) in [3 * record, 3 * record + 1].into_iter().enumerate() {
                let bits = match packed.primitive(2 * record + second) {
                    Some(0) => [0, PASSABLE],
                    Some(1) => [PASSABLE; 2],
                    _ => [0; 2],
                };
                let differs = [0, 1, 2, 3].map(|i| packed.texels[corner][i] ^ marked.texels[corner][i]);
                assert_eq!(differs, [bits[0], bits[1], 0, 0], "record {record}");
            }
        }
    }

    #[test]
    fn children_are_visited_from_the_near_side() {
        let at = |x: f32, y: f32| {
            let lo = Vec3::new(x, y, 0.0);
            (Aabb { lo, hi: lo + 1.0 }, Child::Leaf(0))
        };
        let square = [at(0.0, 0.0), at(0.0, 5.0), at(9.0, 0.0), at(9.0, 5.0)];
        // Octants by the signs of x, y and z: which of the first pair first, which of the two pairs, which of the second pair.
        let expected = [0b000, 0b010, 0b101, 0b111];
        for (octant, order) in expected.into_iter().enumerate() {
            assert_eq!(visiting_orders(&square) >> (4 + 3 * octant) & 7, order, "octant {octant}");
        }
        assert_eq!(visiting_orders(&square[..1]), 0);
        // Shifted by so much, all that a word has above that is no order.
        assert!(include_str!("../../shaders/lib/intersect/bvh/node.glsl").contains("const uint NO_ORDER = 31u;"));
        assert_eq!((NOT_SUBNORMAL | 0x0fff_ffff) >> 31, 0);
        let close = in_pairs(vec![at(0.0, 0.0), at(8.0, 0.0), at(9.0, 0.0)]);
        assert_eq!(close[2].0, at(0.0, 0.0).0);
    }
}
