//! Splits primitives in two by the surface area heuristic, among borders of bins (see builder.rs).

use glam::Vec4;

use crate::accel::aabb::Aabb;

/// Above this many primitives, the work on one node is shared too.
pub(super) const PARALLEL_WITHIN: usize = 1 << 17;
const MAX_BINS: usize = 32;

/// Bits of a small normal float. Indices alone would be subnormal floats, with which arithmetic is a hundred times
/// slower on most processors, even where nobody looks at the result.
const INDEX_BASE: u32 = 0x2000_0000;

/// A primitive with its box. Four floats a corner, so that a corner is one SIMD register.
#[derive(Clone, Copy)]
pub(super) struct Reference {
    /// Lowest corner.
    lo: Vec4,
    /// Highest corner; w holds the primitive's index, as the bits of a float.
    hi: Vec4,
}

impl Reference {
    pub fn new(bounds: Aabb, primitive: u32) -> Self {
        Self { lo: bounds.lo.extend(0.0), hi: bounds.hi.extend(f32::from_bits(INDEX_BASE + primitive)) }
    }

    pub fn primitive(&self) -> u32 {
        self.hi.w.to_bits() - INDEX_BASE
    }

    pub fn centroid(&self) -> Vec4 {
        0.5 * (self.lo + self.hi)
    }
}

/// A box that grows; w means nothing.
#[derive(Clone, Copy)]
pub(super) struct Growing {
    pub lo: Vec4,
    pub hi: Vec4,
}

impl Growing {
    const EMPTY: Self = Self { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    fn with(self, r: &Reference) -> Self {
        Self { lo: self.lo.min(r.lo), hi: self.hi.max(r.hi) }
    }

    fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    fn extended(self, p: Vec4) -> Self {
        Self { lo: self.lo.min(p), hi: self.hi.max(p) }
    }

    pub fn aabb(self) -> Aabb {
        Aabb { lo: self.lo.truncate(), hi: self.hi.truncate() }
    }

    fn half_area(self) -> f32 {
        self.aabb().half_area()
    }
}

/// Bounds of primitives and of their centroids.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub bounds: Growing,
    pub centroids: Growing,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Growing::EMPTY, centroids: Growing::EMPTY };

    pub fn of(references: &[Reference]) -> Self {
        if references.len() > PARALLEL_WITHIN {
            let (left, right) = references.split_at(references.len() / 2);
            let (left, right) = rayon::join(|| Self::of(left), || Self::of(right));
            return left.union(right);
        }
        references.iter().fold(Self::EMPTY, |e, r| e.with(r))
    }

    fn with(self, r: &Reference) -> Self {
        Self { bounds: self.bounds.with(r), centroids: self.centroids.extended(r.centroid()) }
    }

    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), centroids: self.centroids.union(other.centroids) }
    }
}

/// Where a subtree's nodes and leaves go.
#[derive(Clone, Copy)]
pub(super) struct Split {
    axis: usize,
    /// Bins below this go to the first part.
    bin: usize,
    binning: Binning,
}

/// Maps centroids to bins along each axis.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec4,
    scale: Vec4,
    last: Vec4,
    count: usize,
}

impl Binning {
    fn new(centroids: Growing, primitives: usize) -> Self {
        let count = (4 + primitives / 2).min(MAX_BINS);
        let size = centroids.hi - centroids.lo;
        // A flat axis gets scale 0: all in bin 0. The margin keeps the last centroid in the last bin.
        let per_axis = |s: f32| if s > 0.0 { (count as f32 * (1.0 - 1e-6) / s).min(f32::MAX) } else { 0.0 };
        let scale = Vec4::new(per_axis(size.x), per_axis(size.y), per_axis(size.z), 0.0);
        Self { lo: centroids.lo, scale, last: Vec4::splat(count as f32 - 0.5), count }
    }

    /// A number whose lowest bits are the bin, for each axis.
    fn rounded(&self, r: &Reference) -> Vec4 {
        // In range even where the scale overflowed: `max` and `min` drop NaN.
        let x = ((r.centroid() - self.lo) * self.scale).max(Vec4::splat(0.5)).min(self.last);
        x + ROUNDING
    }

    fn bins(&self, r: &Reference) -> [usize; 3] {
        let x = self.rounded(r);
        [x.x, x.y, x.z].map(bin_of)
    }

    fn bin(&self, r: &Reference, axis: usize) -> usize {
        bin_of(self.rounded(r)[axis])
    }
}

/// Added to a small number from a half on, makes a sum whose lowest bits are that number without its fraction (or one less, where
/// there is none): three conversions to integers, with all that is to be looked after there, took a third of the time.
const ROUNDING: f32 = (1 << 23) as f32 - 0.5;

fn bin_of(rounded: f32) -> usize {
    rounded.to_bits() as usize % MAX_BINS
}

/// For each axis and bin, the box of its primitives and their number. Kept from node to node: to clear all of it would
/// cost more than a small node has to do.
pub(super) struct Bins([[(Growing, u32); MAX_BINS]; 3]);

impl Bins {
    pub fn new() -> Box<Self> {
        Box::new(Self([[(Growing::EMPTY, 0); MAX_BINS]; 3]))
    }

    fn fill(&mut self, references: &[Reference], binning: &Binning) {
        for row in &mut self.0 {
            row[..binning.count].fill((Growing::EMPTY, 0));
        }
        if references.len() > PARALLEL_WITHIN {
            let (left, right) = references.split_at(references.len() / 2);
            let mut other = Self::new();
            rayon::join(|| self.fill(left, binning), || other.fill(right, binning));
            for (a, b) in self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()) {
                *a = (a.0.union(b.0), a.1 + b.1);
            }
            return;
        }
        for r in references {
            for (row, b) in self.0.iter_mut().zip(binning.bins(r)) {
                row[b].0 = row[b].0.with(r);
                row[b].1 += 1;
            }
        }
    }
}

/// The split of least SAH cost among all bin borders of all axes; `None` if all centroids share a bin.
pub(super) fn best_split(references: &[Reference], extent: Extent, bins: &mut Bins) -> Option<Split> {
    let binning = Binning::new(extent.centroids, references.len());
    bins.fill(references, &binning);
    let mut best: Option<(f32, Split)> = None;
    for (axis, row) in bins.0.iter().enumerate() {
        if binning.scale[axis] == 0.0 {
            continue;
        }
        // cost_right[i]: of bins i.. together
        let mut cost_right = [0.0f32; MAX_BINS];
        let mut part = (Growing::EMPTY, 0u32);
        for i in (1..binning.count).rev() {
            part = (part.0.union(row[i].0), part.1 + row[i].1);
            cost_right[i] = if part.1 == 0 { f32::INFINITY } else { part.0.half_area() * part.1 as f32 };
        }
        let mut part = (Growing::EMPTY, 0u32);
        for i in 1..binning.count {
            part = (part.0.union(row[i - 1].0), part.1 + row[i - 1].1);
            if part.1 == 0 {
                continue;
            }
            let cost = part.0.half_area() * part.1 as f32 + cost_right[i];
            if cost.is_finite() && best.is_none_or(|(c, _)| cost < c) {
                best = Some((cost, Split { axis, bin: i, binning }));
            }
        }
    }
    best.map(|(_, split)| split)
}

/// Moves the references of the first part to the front.
pub(super) fn partition(references: &mut [Reference], split: Split) -> (usize, [Extent; 2]) {
    let mut extents = [Extent::EMPTY; 2];
    let (mut i, mut j) = (0, references.len());
    while i < j {
        if split.binning.bin(&references[i], split.axis) < split.bin {
            extents[0] = extents[0].with(&references[i]);
            i += 1;
        } else {
            j -= 1;
            extents[1] = extents[1].with(&references[i]);
            references.swap(i, j);
        }
    }
    (i, extents)
}
