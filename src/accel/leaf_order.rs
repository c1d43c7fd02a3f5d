//! The leaves of a packed BVH in the order in which they are met depth first: of these, neighbours are near each other.

use crate::accel::record::{INNER, Packed};

impl Packed {
    /// The records of the leaves.
    pub fn leaf_records(&self) -> Vec<u32> {
        let mut leaves = Vec::with_capacity(self.statistics.leaves);
        let mut stack = vec![0];
        while let Some(record) = stack.pop() {
            let [a, _, c] = [0, 1, 2].map(|i| self.texels[3 * record as usize + i][3]);
            if a < INNER {
                leaves.push(record);
            } else {
                let first = a & !INNER;
                stack.extend((first..first + (c & 15).count_ones()).rev());
            }
        }
        leaves
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::accel::{Aabb, Packed, Primitive, build, leaves, pack, random_numbers};

    #[test]
    fn each_leaf_is_there_once_and_neighbours_are_near() {
        let mut random = random_numbers(7);
        let mut point = |size: f32| size * Vec3::new(random(), random(), random());
        let soup: Vec<_> = (0..5000)
            .map(|_| {
                let center = point(1.0);
                Primitive::Triangle { vertices: [(); 3].map(|()| center + point(0.01)) }
            })
            .collect();
        let held = leaves(&soup);
        let of_leaf = |leaf: &crate::accel::Leaf| {
            leaf.members().fold(Aabb::EMPTY, |all, i| all.union(soup[i as usize].bounds(0.0)))
        };
        let packed = pack(&build(&held.iter().map(of_leaf).collect::<Vec<_>>()).unwrap(), &held, &soup, 0);
        let order = packed.leaf_records();
        let mut sorted = order.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!((sorted.len(), order.len()), (held.len(), held.len()));
        let place = |record: &u32| {
            let primitive = packed.primitive(2 * *record as usize).unwrap();
            soup[primitive as usize].extent().centroid()
        };
        let steps: f32 = order.windows(2).map(|pair| place(&pair[0]).distance(place(&pair[1]))).sum();
        // Two points of a unit cube are .66 apart.
        assert!(steps / (order.len() as f32) < 0.15, "{steps}");
        assert_eq!(Packed::nothing().leaf_records(), Vec::<u32>::new());
    }
}
