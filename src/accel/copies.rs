//! Exact copies of primitives: thousands of them would all have to be visited, and the first of them is what rays hit.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::hash::mix;

use crate::accel::primitive::Primitive;

/// Bits of a table for each primitive: of so many pairs that are no copies one looks like one.
const BITS: usize = 16;

/// The numbers of the primitives that have the shape of another, in ascending order: of each shape all but the first emitter, or the first
/// primitive if none is an emitter. (Emitters are sampled, and are to be seen as well.)
pub fn copies(primitives: &[Primitive], is_area_light: impl Fn(usize) -> bool + Sync) -> Vec<u32> {
    let bits = (BITS * primitives.len()).next_power_of_two().max(64);
    let (once, twice) = (Bits::of(bits), Bits::of(bits));
    let hashes: Vec<u64> = primitives.par_iter().map(hash).collect();
    hashes.par_iter().filter(|&&hash| once.set(hash)).for_each(|&hash| {
        twice.set(hash);
    });
    let mut suspects: Vec<(u64, bool, u32)> = (0..primitives.len() as u32)
        .into_par_iter()
        .map(|i| (hashes[i as usize], !is_area_light(i as usize), i))
        .filter(|&(hash, ..)| twice.get(hash))
        .collect();
    suspects.par_sort_unstable();
    let mut copies = Vec::new();
    let mut firsts: Vec<u32> = Vec::new();
    for alike in suspects.chunk_by(|a, b| a.0 == b.0) {
        firsts.clear();
        for &(.., i) in alike {
            if firsts.iter().any(|&first| has_same_shape(&primitives[first as usize], &primitives[i as usize])) {
                copies.push(i);
            } else {
                firsts.push(i);
            }
        }
    }
    copies.sort_unstable();
    copies
}

fn has_same_shape(a: &Primitive, b: &Primitive) -> bool {
    match (a, b) {
        (Primitive::Triangle { vertices: a }, Primitive::Triangle { vertices: b }) => a == b,
        (Primitive::Sphere { center: a, radius: r }, Primitive::Sphere { center: b, radius: s }) => a == b && r == s,
        _ => false,
    }
}

/// The same for all that have the same shape.
fn hash(primitive: &Primitive) -> u64 {
    // A zero may have either sign.
    let add = |hash: u64, x: f32| mix(hash, (x + 0.0).to_bits());
    let hash = match primitive {
        Primitive::Triangle { vertices } => vertices.iter().flat_map(|v| v.to_array()).fold(1, add),
        Primitive::Sphere { center, radius } => add(center.to_array().into_iter().fold(2, add), *radius),
    };
    // The lower bits depend on few of the numbers.
    hash ^ hash >> 32
}

/// A set of bits that several threads set.
struct Bits {
    words: Vec<AtomicU64>,
}

impl Bits {
    fn of(bits: usize) -> Self {
        Self { words: (0..bits / 64).map(|_| AtomicU64::new(0)).collect() }
    }

    fn place(&self, hash: u64) -> (&AtomicU64, u64) {
        let bit = hash as usize & (64 * self.words.len() - 1);
        (&self.words[bit / 64], 1 << (bit % 64))
    }

    /// Returns whether it was set already.
    fn set(&self, hash: u64) -> bool {
        let (word, mask) = self.place(hash);
        word.fetch_or(mask, Ordering::Relaxed) & mask != 0
    }

    fn get(&self, hash: u64) -> bool {
        let (word, mask) = self.place(hash);
        word.load(Ordering::Relaxed) & mask != 0
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// Where none is an emitter.
    fn copies(primitives: &[Primitive]) -> Vec<u32> {
        super::copies(primitives, |_| false)
    }

    fn triangle(corner: Vec3) -> Primitive {
        let vertices = [corner, corner + Vec3::X, corner + Vec3::Y];
        Primitive::Triangle { vertices }
    }

    #[test]
    fn all_but_the_first_of_each_shape_are_copies() {
        let mut random = crate::accel::random_numbers(9);
        let mut primitives: Vec<Primitive> =
            (0..5000).map(|_| triangle(Vec3::new(random(), random(), random()))).collect();
        assert!(copies(&primitives).is_empty());
        primitives.push(triangle(Vec3::new(0.0, 0.5, 0.0)));
        primitives.extend_from_within(40..42);
        primitives.push(triangle(Vec3::new(-0.0, 0.5, -0.0)));
        primitives.extend_from_within(40..41);
        let sphere = |radius| Primitive::Sphere { center: Vec3::ONE, radius };
        primitives.extend([sphere(1.0), sphere(2.0), sphere(1.0)]);
        assert_eq!(copies(&primitives), [5001, 5002, 5003, 5004, 5007]);
        // The same corners in another order are not the same bits of a hit.
        if let Primitive::Triangle { vertices } = &mut primitives[5001] {
            vertices.rotate_left(1);
        }
        assert_eq!(copies(&primitives), [5002, 5003, 5004, 5007]);
        // An emitter counts before what is none, wherever it is.
        let emitters = [5007, 5004, 40];
        assert_eq!(super::copies(&primitives, |i| emitters.contains(&i)), [5002, 5003, 5004, 5005]);
        assert!(copies(&[]).is_empty());
        assert_eq!(copies(&vec![sphere(1.0); 3000]).len(), 2999);
    }
}
