//! Ray queries by themselves: which rays find what, by flags, masks and intervals, as Vulkan says.

use glam::Vec3;

use ash::vk::GeometryInstanceFlagsKHR as Flags;

use crate::check::probe::{PlainKernel, WORKGROUP};
use crate::check::rng::Rng;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::gpu::{AccelerationStructure, BuildOptions, Instance, Part, Shapes, Specialization, Timeline};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "query/flags",
        what: "every combination of flags of rays (opacity, culled faces, end at the first hit), geometries and instances (opacity, facing, culling), masks, triangles and boxes, from both sides",
        oracle: "the specification's rules",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: flags,
    },
    Case {
        name: "query/t-interval",
        what: "rays that begin or end 1 ulp before or behind a triangle, at 0, and within, before and behind a box",
        oracle: "hits lie within the interval; boxes that it overlaps are proposed",
        quantity: "rays that find what they should not, or not what they should",
        threshold: 0.0,
        full_only: false,
        measure: intervals,
    },
];

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/ray_query.spv"));

// Flags of rays (SPIR-V).
const OPAQUE: u32 = 0x1;
const NO_OPAQUE: u32 = 0x2;
const TERMINATE: u32 = 0x4;
const CULL_BACK: u32 = 0x10;
const CULL_FRONT: u32 = 0x20;
const CULL_OPAQUE: u32 = 0x40;
const CULL_NO_OPAQUE: u32 = 0x80;

/// As seen from +z its corners run counter-clockwise.
const TRIANGLE: [[f32; 3]; 3] = [[-1.0, -1.0, -2.0], [1.0, -1.0, -2.0], [0.0, 1.0, -2.0]];
const BOX: [[f32; 3]; 2] = [[-1.0, -1.0, -2.5], [1.0, 1.0, -1.5]];
const MASK: u8 = 0b101;

/// A ray, as shaders/execution/ray_query.comp reads it.
#[derive(Clone, Copy)]
struct Asked {
    origin: Vec3,
    direction: Vec3,
    interval: [f32; 2],
    flags: u32,
    mask: u32,
}

impl Asked {
    fn words(&self) -> impl Iterator<Item = u32> {
        let floats = [self.origin.to_array(), self.direction.to_array()].concat();
        let floats: Vec<u32> = floats.into_iter().chain(self.interval).map(f32::to_bits).collect();
        floats.into_iter().chain([self.flags, self.mask])
    }
}

/// What a ray finds.
#[derive(Clone, Copy, PartialEq, Default)]
struct Found {
    /// Triangles, then bits for boxes, and for opaque ones.
    proposed: u32,
    committed: u32,
    t: f32,
    instance: u32,
}

impl Found {
    const BOX: u32 = 0x100;
    const OPAQUE_BOX: u32 = 0x200;

    fn words(&self) -> [u32; 4] {
        [self.proposed, self.committed, self.t.to_bits(), self.instance]
    }
}

fn ask(lab: &Lab, parts: &[Part<'_>], instances: &[Instance], rays: &[Asked]) -> Result<Vec<Found>, CheckError> {
    let device = &lab.context.0;
    device.ray_queries().map_err(|_| CheckError::NotSupported("it has no ray queries".to_owned()))?;
    let mut timeline = Timeline::new(device, 1)?;
    let structure = AccelerationStructure::new(device, &mut timeline, parts, instances, BuildOptions::default())?;
    let mut constants = Specialization::default();
    constants.uint(WORKGROUP, 64);
    let words: Vec<u32> = rays.iter().flat_map(Asked::words).collect();
    let sizes = [words.len(), 4 * rays.len()];
    let mut kernel = PlainKernel::with(&lab.context, "ray query", SPIRV, &constants, sizes, 1, Some(&structure))?;
    let found = kernel.run(&words, [rays.len() as u32, 0], rays.len().div_ceil(64) as u32, sizes[1])?;
    let of_words = |w: &[u32]| Found { proposed: w[0], committed: w[1], t: f32::from_bits(w[2]), instance: w[3] };
    Ok(found.chunks_exact(4).map(of_words).collect())
}

/// A geometry and an instance of it.
#[derive(Clone, Copy)]
struct Placed {
    is_box: bool,
    opaque: bool,
    flags: Flags,
}

impl Placed {
    fn all() -> Vec<Self> {
        let forced = [Flags::empty(), Flags::FORCE_OPAQUE, Flags::FORCE_NO_OPAQUE];
        let mut all = Vec::new();
        for part in 0..4 {
            for force in forced {
                for facing in [Flags::empty(), Flags::TRIANGLE_FLIP_FACING] {
                    for culling in [Flags::empty(), Flags::TRIANGLE_FACING_CULL_DISABLE] {
                        all.push(Self { is_box: part >= 2, opaque: part % 2 == 0, flags: force | facing | culling });
                    }
                }
            }
        }
        all
    }

    /// What a ray finds that meets it, from the side of +z or the other.
    fn oracle(&self, index: usize, from_above: bool, ray: &Asked) -> Found {
        let nothing = Found::default();
        if ray.mask & u32::from(MASK) == 0 {
            return nothing;
        }
        let has = |flag| ray.flags & flag != 0;
        let mut opaque = self.opaque;
        if self.flags.contains(Flags::FORCE_OPAQUE) || self.flags.contains(Flags::FORCE_NO_OPAQUE) {
            opaque = self.flags.contains(Flags::FORCE_OPAQUE);
        }
        if has(OPAQUE) || has(NO_OPAQUE) {
            opaque = has(OPAQUE);
        }
        if (opaque && has(CULL_OPAQUE)) || (!opaque && has(CULL_NO_OPAQUE)) {
            return nothing;
        }
        if self.is_box {
            return Found { proposed: Found::BOX | if opaque { Found::OPAQUE_BOX } else { 0 }, ..nothing };
        }
        // Corners of fronts run counter-clockwise, as seen from where the ray starts, unless they are turned over.
        let front = from_above != self.flags.contains(Flags::TRIANGLE_FLIP_FACING);
        let culled = if front { has(CULL_FRONT) } else { has(CULL_BACK) };
        if culled && !self.flags.contains(Flags::TRIANGLE_FACING_CULL_DISABLE) {
            return nothing;
        }
        match opaque {
            true => Found { committed: 1, t: if from_above { 2.0 } else { 4.0 }, instance: index as u32, ..nothing },
            false => Found { proposed: 1, ..nothing },
        }
    }
}

fn flags(lab: &Lab) -> Result<Measured, CheckError> {
    let (triangle, cube) = ([TRIANGLE], [BOX]);
    let shapes = [Shapes::Triangles(&triangle), Shapes::Boxes(&cube)];
    let parts = [0, 1].map(|shape| [true, false].map(|opaque| Part { shapes: shapes[shape], opaque }));
    let placed = Placed::all();
    let x = |index: usize| 4.0 * index as f32;
    let instances = placed.iter().enumerate().map(|(index, p)| {
        let part = usize::from(p.is_box) * 2 + usize::from(!p.opaque);
        Instance { offset: [x(index), 0.0, 0.0], mask: MASK, flags: p.flags, ..Instance::of(part, index as u32) }
    });
    let instances: Vec<_> = instances.collect();
    let (mut rays, mut expected) = (Vec::new(), Vec::new());
    for (index, one) in placed.iter().enumerate() {
        for from_above in [true, false] {
            let z = if from_above { 0.0 } else { -6.0 };
            let (origin, direction) =
                (Vec3::new(x(index) + 0.125, -0.25, z), Vec3::Z * if from_above { -1.0 } else { 1.0 });
            for opacity in [0, OPAQUE, NO_OPAQUE, CULL_OPAQUE, CULL_NO_OPAQUE] {
                for culled in [0, CULL_BACK, CULL_FRONT] {
                    for (end, mask) in [(0, 4), (0, 0xfa), (TERMINATE, 0xff), (TERMINATE, 2)] {
                        let flags = opacity | culled | end;
                        let ray = Asked { origin, direction, interval: [0.0, f32::INFINITY], flags, mask };
                        expected.push(one.oracle(index, from_above, &ray));
                        rays.push(ray);
                    }
                }
            }
        }
    }
    let mut found = ask(lab, &parts.concat(), &instances, &rays)?;
    for (found, expected) in found.iter_mut().zip(&expected) {
        // How exact distances are is for others to tell.
        if (found.t - expected.t).abs() <= 1e-6 * expected.t {
            found.t = expected.t;
        }
    }
    let words = |all: &[Found]| all.iter().flat_map(Found::words).collect::<Vec<_>>();
    let differ = lab.differing("rays, four words each", &words(&expected), &words(&found));
    Ok(Measured::new(differ as f64, format!("{} rays, {} instances", rays.len(), placed.len())))
}

/// An interval for a ray that meets a triangle at a distance, and whether the hit is within; of both ends the specification leaves that open.
struct Variant {
    what: &'static str,
    interval: fn(f32) -> [f32; 2],
    is_hit: Option<bool>,
}

const VARIANTS: [Variant; 8] = [
    Variant { what: "begin 1 ulp before", interval: |t| [t.next_down(), f32::INFINITY], is_hit: Some(true) },
    Variant { what: "begin 1 ulp behind", interval: |t| [t.next_up(), f32::INFINITY], is_hit: Some(false) },
    Variant { what: "end 1 ulp before", interval: |t| [0.0, t.next_down()], is_hit: Some(false) },
    Variant { what: "end 1 ulp behind", interval: |t| [0.0, t.next_up()], is_hit: Some(true) },
    Variant { what: "end at once", interval: |_| [0.0; 2], is_hit: Some(false) },
    Variant { what: "begin and end 1 ulp away", interval: |t| [t.next_down(), t.next_up()], is_hit: Some(true) },
    Variant { what: "begin there", interval: |t| [t, f32::INFINITY], is_hit: None },
    Variant { what: "end there", interval: |t| [0.0, t], is_hit: None },
];

fn intervals(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(54);
    let (triangle, cube) = ([TRIANGLE], [BOX]);
    let count = lab.size(1 << 12, 1 << 18);
    let toward = |target: Vec3, rng: &mut Rng| {
        let origin = Vec3::new(0.0, 0.0, 1.0) + rng.in_cube(1.0).as_vec3();
        let interval = [0.0, f32::INFINITY];
        Asked { origin, direction: (target - origin).normalize(), interval, flags: 0, mask: 0xff }
    };
    let within = |rng: &mut Rng| {
        let [a, b, c] = TRIANGLE.map(Vec3::from);
        a.lerp(b, rng.between(0.1, 0.9) as f32).lerp(c, rng.between(0.1, 0.8) as f32)
    };
    let open: Vec<_> = (0..count)
        .map(|_| {
            let target = within(&mut rng);
            toward(target, &mut rng)
        })
        .collect();
    let part = [Part { shapes: Shapes::Triangles(&triangle), opaque: true }];
    let instance = [Instance { mask: MASK, ..Instance::of(0, 0) }];
    let hits = ask(lab, &part, &instance, &open)?;
    let mut wrong = hits.iter().filter(|hit| hit.committed != 1).count();
    let mut at_ends = Vec::new();
    for Variant { what, interval, is_hit } in VARIANTS {
        let rays: Vec<_> =
            open.iter().zip(&hits).map(|(ray, hit)| Asked { interval: interval(hit.t), ..*ray }).collect();
        let actual: Vec<_> = ask(lab, &part, &instance, &rays)?.iter().map(|found| found.committed).collect();
        match is_hit {
            Some(is_hit) => wrong += lab.differing(what, &vec![u32::from(is_hit); rays.len()], &actual),
            None => at_ends.push(actual.iter().filter(|committed| **committed != 0).count()),
        }
    }
    // Boxes: the interval ends within, lies within, begins within.
    let part = [Part { shapes: Shapes::Boxes(&cube), opaque: false }];
    let (lo, hi) = (Vec3::from(BOX[0]), Vec3::from(BOX[1]));
    let mut rays = Vec::new();
    for _ in 0..count {
        let inner = (lo + hi) / 2.0 + (hi - lo) * 0.4 * rng.in_cube(1.0).as_vec3();
        let ray = toward(inner, &mut rng);
        let t = (inner - ray.origin).length();
        for interval in [[0.0, t], [t, f32::INFINITY], [0.99 * t, 1.01 * t]] {
            rays.push(Asked { interval, ..ray });
        }
    }
    wrong += ask(lab, &part, &instance, &rays)?.iter().filter(|found| found.proposed & Found::BOX == 0).count();
    let detail = format!(
        "{} rays; of {count} hits {} are found by rays that begin there, {} by rays that end there",
        (1 + VARIANTS.len()) * count + rays.len(),
        at_ends[0],
        at_ends[1]
    );
    Ok(Measured::new(wrong as f64, detail))
}
