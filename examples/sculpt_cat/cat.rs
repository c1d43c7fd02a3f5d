//! The cat: sitting on y = 0, body towards +z, the head turned a little to its left (+x). About one unit tall.

use crate::field::{blend, carve, chain, common, ellipsoid, round_cone, sphere};
use glam::{DMat3, DVec3, dvec3};

/// Centre of the head, the point that all head coordinates are relative to.
const HEAD: DVec3 = dvec3(0.012, 0.725, 0.110);

/// Size of the head relative to head coordinates.
const HEAD_SCALE: f64 = 1.1;

/// Centre of the left eyeball in head coordinates.
const EYE: DVec3 = dvec3(0.060, 0.013, 0.068);

/// Radius of an eyeball.
const EYEBALL: f64 = 0.052;

/// Centre of the rounded tip of the left ear in head coordinates.
const EAR_TIP: DVec3 = dvec3(0.134, 0.205, -0.005);

/// The cat as an implicit surface.
#[derive(Debug)]
pub struct Cat {
    head_from_body: DMat3,
    eye_from_head: DMat3,
    foreleg: Vec<(DVec3, f64)>,
    tail: Vec<(DVec3, f64)>,
}

impl Cat {
    /// Fixes the pose: where the head looks, how the tail lies.
    pub fn new() -> Self {
        // Towards (+x, −y, +z), the head tilted slightly towards one shoulder.
        let head_from_body = frame(dvec3(0.36, -0.04, 1.0), dvec3(0.07, 1.0, 0.0));
        // The eyes look outwards a little; their outer corners are raised.
        let eye_from_head = frame(dvec3(0.30, 0.10, 1.0), dvec3(-0.26, 1.0, 0.0));
        Self { head_from_body, eye_from_head, foreleg: spline(&FORELEG), tail: spline(&TAIL) }
    }

    /// Negative inside, positive outside; zero is the surface.
    pub fn field(&self, p: DVec3) -> f64 {
        // The cat is symmetric but for head and tail: the legs are modelled once, for x > 0.
        // |x| rounded off, so that they meet without a crease.
        let m = dvec3((p.x * p.x + 2e-4).sqrt(), p.y, p.z);
        let mut d = torso(p);
        d = blend(d, haunch(m), 0.05);
        d = blend(d, hind_foot(m), 0.025);
        d = blend(d, self.foreleg(m), 0.06);
        d = blend(d, chain(p, &self.tail), 0.018);
        d = blend(d, HEAD_SCALE * self.head(self.head_from_body * (p - HEAD) / HEAD_SCALE), 0.05);
        common(d, -p.y, 0.012)
    }

    fn foreleg(&self, m: DVec3) -> f64 {
        blend(chain(m, &self.foreleg), paw(m, dvec3(0.070, 0.0, 0.168), 0.048), 0.03)
    }

    /// The head in its own frame: x to its left, y up, z along the gaze.
    fn head(&self, q: DVec3) -> f64 {
        let m = dvec3(q.x.abs(), q.y, q.z);
        let mut d = ellipsoid(m, dvec3(0.0, 0.012, 0.0), dvec3(0.148, 0.120, 0.126));
        let cheek = ellipsoid(m, dvec3(0.085, -0.048, 0.030), dvec3(0.074, 0.055, 0.068));
        d = blend(d, cheek, 0.05);
        d = blend(d, ear(m), 0.03);
        let bridge = round_cone(m, dvec3(0.0, 0.045, 0.085), 0.036, dvec3(0.0, -0.020, 0.128), 0.022);
        d = blend(d, bridge, 0.03);
        d = blend(d, sphere(m, dvec3(0.0, -0.088, 0.096), 0.028), 0.03);
        d = self.with_eye(d, m);
        // Two whisker pads that meet in a crease below the nose.
        d = blend(d, ellipsoid(m, dvec3(0.028, -0.056, 0.118), dvec3(0.039, 0.028, 0.035)), 0.016);
        blend(d, ellipsoid(m, dvec3(0.0, -0.028, 0.148), dvec3(0.020, 0.013, 0.014)), 0.006)
    }

    /// Draws lattice points towards the head, and there towards eyes and tips of the ears, where the detail is.
    pub fn focus(&self, p: DVec3) -> DVec3 {
        let body_from_head = self.head_from_body.transpose();
        let place = |q: DVec3| HEAD + HEAD_SCALE * (body_from_head * q);
        let mut moved = contract(p, place(dvec3(0.0, 0.03, 0.07)), 0.6, 0.22);
        for side in [dvec3(1.0, 1.0, 1.0), dvec3(-1.0, 1.0, 1.0)] {
            moved = contract(moved, place(side * EAR_TIP), 0.5, 0.07);
            moved = contract(moved, place(side * (EYE + DVec3::Z * EYEBALL)), 0.45, 0.06);
        }
        moved
    }

    /// A socket, in it an almond-shaped eye, in that a slit pupil.
    fn with_eye(&self, head: f64, m: DVec3) -> f64 {
        // The almond is where two discs overlap, 2·HALF_WIDTH by 2·HALF_HEIGHT.
        const HALF_WIDTH: f64 = 0.049;
        const HALF_HEIGHT: f64 = 0.0315;
        const DISC: f64 = (HALF_WIDTH * HALF_WIDTH + HALF_HEIGHT * HALF_HEIGHT) / (2.0 * HALF_HEIGHT);
        let e = self.eye_from_head * (m - EYE);
        let socket = ellipsoid(e, dvec3(0.0, 0.003, EYEBALL), dvec3(0.052, 0.039, 0.018));
        let disc = |y: f64| (e.x * e.x + y * y).sqrt() - DISC;
        let almond = common(disc(e.y - DISC + HALF_HEIGHT), disc(e.y + DISC - HALF_HEIGHT), 0.006);
        let eye = common(almond, e.length() - EYEBALL, 0.006);
        // Against the eye's tilt, the pupil is upright.
        let upright = dvec3(e.x - 0.26 * e.y, e.y, e.z);
        let pupil = ellipsoid(upright, dvec3(0.0, 0.0, EYEBALL), dvec3(0.009, 0.024, 0.012));
        carve(blend(carve(head, socket, 0.014), eye, 0.004), pupil, 0.010)
    }
}

/// Moves `p` towards `center`: shrinks space by `1 − strength` there, half as strongly `radius` away, not at all far off.
/// One-to-one for a strength below 1, as distance × scale then grows with distance.
fn contract(p: DVec3, center: DVec3, strength: f64, radius: f64) -> DVec3 {
    let offset = p - center;
    center + offset * (1.0 - strength / (1.0 + offset.length_squared() / (radius * radius)))
}

/// Rotation into the frame whose z axis is `forward` and whose y axis is as near to `up` as can be.
fn frame(forward: DVec3, up: DVec3) -> DMat3 {
    let z = forward.normalize();
    let x = up.cross(z).normalize();
    DMat3::from_cols(x, z.cross(x), z).transpose()
}

fn torso(p: DVec3) -> f64 {
    let belly = ellipsoid(p, dvec3(0.0, 0.22, -0.13), dvec3(0.165, 0.22, 0.195));
    let ribs = ellipsoid(p, dvec3(0.0, 0.40, -0.025), dvec3(0.135, 0.20, 0.15));
    let chest = ellipsoid(p, dvec3(0.0, 0.46, 0.065), dvec3(0.115, 0.16, 0.105));
    let neck = round_cone(p, dvec3(0.0, 0.50, 0.02), 0.112, dvec3(0.01, 0.69, 0.075), 0.088);
    blend(blend(blend(belly, ribs, 0.12), chest, 0.08), neck, 0.07)
}

fn haunch(m: DVec3) -> f64 {
    let thigh = ellipsoid(m, dvec3(0.135, 0.165, -0.085), dvec3(0.085, 0.155, 0.16));
    let knee = ellipsoid(m, dvec3(0.165, 0.16, 0.0), dvec3(0.055, 0.105, 0.085));
    blend(thigh, knee, 0.06)
}

fn hind_foot(m: DVec3) -> f64 {
    let foot = round_cone(m, dvec3(0.165, 0.03, -0.06), 0.04, dvec3(0.178, 0.026, 0.09), 0.036);
    blend(foot, paw(m, dvec3(0.18, 0.0, 0.105), 0.05), 0.02)
}

/// A paw of three toes in a row at `center` (on the ground), about `2·width` wide.
fn paw(m: DVec3, center: DVec3, width: f64) -> f64 {
    let pad = ellipsoid(m, center + dvec3(0.0, 0.028, -0.015), dvec3(width, 0.040, 0.056));
    [-0.6, 0.0, 0.6].iter().fold(pad, |d, &s| {
        let at = center + dvec3(s * width, 0.020, 0.028 - 0.03 * s * s);
        blend(d, ellipsoid(m, at, dvec3(width * 0.36, 0.029, 0.034)), 0.012)
    })
}

/// A cone flattened front to back, hollow in front.
fn ear(m: DVec3) -> f64 {
    const FLATTEN: f64 = 1.8;
    let flat = |d: DVec3| dvec3(d.x, d.y, d.z * FLATTEN);
    let cone = |base: DVec3, rb: f64, tip: DVec3, rt: f64| round_cone(flat(m), flat(base), rb, flat(tip), rt) / FLATTEN;
    let base = dvec3(0.088, 0.060, -0.005);
    let forward = dvec3(0.0, -0.008, 0.027);
    let shell = cone(base, 0.074, EAR_TIP, 0.017);
    let hollow = cone(base + forward, 0.058, EAR_TIP + forward, 0.006);
    carve(shell, hollow, 0.010)
}

/// Control points x, y, z and radius of a foreleg, from the shoulder to the wrist.
const FORELEG: [[f64; 4]; 6] = [
    [0.066, 0.60, 0.01, 0.055],
    [0.084, 0.45, 0.045, 0.070],
    [0.084, 0.32, 0.105, 0.058],
    [0.076, 0.20, 0.138, 0.044],
    [0.070, 0.10, 0.148, 0.037],
    [0.070, 0.00, 0.156, 0.038],
];

/// Control points of the tail: from the rump around the left side (+x) to the front paws.
const TAIL: [[f64; 4]; 9] = [
    [0.00, 0.12, -0.20, 0.060],
    [0.01, 0.07, -0.33, 0.050],
    [0.14, 0.045, -0.40, 0.045],
    [0.30, 0.04, -0.27, 0.043],
    [0.345, 0.04, -0.04, 0.042],
    [0.325, 0.04, 0.17, 0.041],
    [0.20, 0.04, 0.30, 0.040],
    [0.06, 0.04, 0.31, 0.034],
    [-0.05, 0.055, 0.27, 0.022],
];

/// Points and radii along the quadratic B-spline of `control`, close enough together to look smooth.
fn spline(control: &[[f64; 4]]) -> Vec<(DVec3, f64)> {
    const STEPS: usize = 6;
    let mut knots: Vec<_> = control
        .windows(3)
        .flat_map(|c| {
            (0..=STEPS).map(move |i| {
                let t = i as f64 / STEPS as f64;
                let weights = [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t];
                let [x, y, z, radius] =
                    std::array::from_fn(|k| weights[0] * c[0][k] + weights[1] * c[1][k] + weights[2] * c[2][k]);
                (dvec3(x, y, z), radius)
            })
        })
        .collect();
    // Each span ends where the next begins.
    knots.dedup_by(|a, b| a.0.distance_squared(b.0) < 1e-12);
    knots
}
