//! Lights as the shaders see them, and the tree through which one of many is chosen.
//!
//! Conty Estevez and Kulla, "Importance sampling of many lights with adaptive tree splitting" (HPG 2018), without the
//! splitting; see shaders/lib/light/tree.glsl.

use glam::{DVec3, Vec3};

use crate::scene::Rgb;

/// A source of light in render space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Light {
    pub shape: LightShape,
    /// Φ/(4π²) of a point, radiance of a surface.
    pub radiance: Rgb,
}

/// Where a light is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LightShape {
    Point(DVec3),
    Triangle([DVec3; 3]),
    /// A corner and its two neighbours.
    Parallelogram([DVec3; 3]),
    Sphere {
        center: DVec3,
        radius: f64,
        inward: bool,
    },
}

impl Light {
    fn bounds(&self) -> (DVec3, DVec3) {
        match self.shape {
            LightShape::Point(p) => (p, p),
            LightShape::Triangle([a, b, c]) => (a.min(b).min(c), a.max(b).max(c)),
            LightShape::Parallelogram([a, b, c]) => {
                let d = b + c - a;
                (a.min(b).min(c).min(d), a.max(b).max(c).max(d))
            }
            LightShape::Sphere { center, radius, .. } => (center - radius, center + radius),
        }
    }

    /// What a white diffuse surface facing it at distance 1 would reflect, summed over channels.
    fn strength(&self) -> f64 {
        let size = match self.shape {
            LightShape::Point(_) => 1.0,
            LightShape::Triangle([a, b, c]) => (b - a).cross(c - a).length() / 2.0 / std::f64::consts::PI,
            LightShape::Parallelogram([a, b, c]) => (b - a).cross(c - a).length() / std::f64::consts::PI,
            LightShape::Sphere { radius, inward: false, .. } => radius * radius,
            // Seen from inside, all of it shines.
            LightShape::Sphere { radius, inward: true, .. } => 4.0 * radius * radius,
        };
        size * self.radiance.iter().sum::<f64>()
    }

    fn cone(&self) -> Cone {
        match self.shape {
            LightShape::Triangle([a, b, c]) | LightShape::Parallelogram([a, b, c]) => {
                Cone { axis: (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z), angle: 0.0 }
            }
            LightShape::Point(_) | LightShape::Sphere { .. } => Cone::ALL,
        }
    }
}

/// Directions within an angle of an axis.
#[derive(Debug, Clone, Copy)]
struct Cone {
    axis: DVec3,
    /// Radians, 0..=π.
    angle: f64,
}

impl Cone {
    const ALL: Self = Self { axis: DVec3::Z, angle: std::f64::consts::PI };

    /// The smallest cone around both.
    fn union(self, other: Self) -> Self {
        let (wide, narrow) = if self.angle >= other.angle { (self, other) } else { (other, self) };
        let between = wide.axis.angle_between(narrow.axis);
        if (between + narrow.angle).min(std::f64::consts::PI) <= wide.angle {
            return wide;
        }
        let angle = (wide.angle + between + narrow.angle) / 2.0;
        if angle >= std::f64::consts::PI {
            return Self::ALL;
        }
        let turn = angle - wide.angle;
        let Some(side) = (narrow.axis - wide.axis * wide.axis.dot(narrow.axis)).try_normalize() else {
            return Self::ALL;
        };
        Self { axis: wide.axis * turn.cos() + side * turn.sin(), angle }
    }
}

/// The packed tree and lights.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LightTable {
    /// Nodes of three texels, then lights of four.
    pub texels: Vec<[f32; 4]>,
    pub nodes: u32,
    /// Levels below the root.
    pub depth: u32,
}

/// Deepest leaf: a light's path from the root has 32 bits. Below half of that, splits follow the cost; then they halve.
const HALVE_BELOW: u32 = 8;

struct Node {
    lo: DVec3,
    hi: DVec3,
    strength: f64,
    cone: Cone,
    /// First of two children, or the light.
    link: i32,
}

impl LightTable {
    /// Builds the tree over lights; an empty table for none.
    pub fn of(lights: &[Light]) -> Self {
        if lights.is_empty() {
            return Self { texels: vec![[0.0; 4]], ..Self::default() };
        }
        let mut builder = Builder { lights, nodes: Vec::new(), trails: vec![(0, 0); lights.len()] };
        let mut order: Vec<u32> = (0..lights.len() as u32).collect();
        builder.nodes.push(builder.node(&order));
        builder.split(0, &mut order, 0, 0);
        let mut texels = Vec::with_capacity(3 * builder.nodes.len() + 4 * lights.len());
        for n in &builder.nodes {
            let cos = if n.cone.angle >= std::f64::consts::PI { -1.0 } else { n.cone.angle.cos() as f32 };
            texels.push(texel(n.lo, n.strength as f32));
            texels.push(texel(n.hi, f32::from_bits(n.link as u32)));
            texels.push(texel(n.cone.axis, cos));
        }
        for (light, &(trail, depth)) in lights.iter().zip(&builder.trails) {
            texels.extend(light_texels(light, trail, depth));
        }
        let depth = builder.trails.iter().map(|t| t.1).max().unwrap_or(0);
        Self { texels, nodes: builder.nodes.len() as u32, depth }
    }
}

struct Builder<'a> {
    lights: &'a [Light],
    nodes: Vec<Node>,
    /// Of each light: its path from the root, and its depth.
    trails: Vec<(u32, u32)>,
}

impl Builder<'_> {
    fn node(&self, members: &[u32]) -> Node {
        let start = Node {
            lo: DVec3::INFINITY,
            hi: DVec3::NEG_INFINITY,
            strength: 0.0,
            cone: self.lights[members[0] as usize].cone(),
            link: !(members[0] as i32),
        };
        members.iter().fold(start, |n, &i| {
            let light = &self.lights[i as usize];
            let (lo, hi) = light.bounds();
            Node {
                lo: n.lo.min(lo),
                hi: n.hi.max(hi),
                strength: n.strength + light.strength(),
                cone: n.cone.union(light.cone()),
                link: n.link,
            }
        })
    }

    /// Gives a node its children.
    fn split(&mut self, index: usize, members: &mut [u32], trail: u32, depth: u32) {
        if let [only] = *members {
            self.trails[only as usize] = (trail, depth);
            return;
        }
        let middle = self.arrange(members, depth);
        let (first, second) = members.split_at_mut(middle);
        let link = self.nodes.len();
        self.nodes[index].link = link as i32;
        let children = [self.node(first), self.node(second)];
        self.nodes.extend(children);
        self.split(link, first, trail, depth + 1);
        self.split(link + 1, second, trail | 1 << depth, depth + 1);
    }

    /// Sorts members along an axis and returns where to cut them.
    fn arrange(&self, members: &mut [u32], depth: u32) -> usize {
        let centre = |i: u32| {
            let (lo, hi) = self.lights[i as usize].bounds();
            (lo + hi) / 2.0
        };
        let (lo, hi) = members
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &i| (lo.min(centre(i)), hi.max(centre(i))));
        let size = hi - lo;
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        members.sort_by(|&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b)));
        if depth >= HALVE_BELOW {
            return members.len() / 2;
        }
        // Strength times the size and the spread of directions on both sides: what the bound cannot tell apart.
        let costs = |reverse: bool| -> Vec<f64> {
            let mut sum: Option<Node> = None;
            let step = |&i: &u32| {
                let n = self.node(&[i]);
                let joined = match sum.take() {
                    None => n,
                    Some(s) => Node {
                        lo: s.lo.min(n.lo),
                        hi: s.hi.max(n.hi),
                        strength: s.strength + n.strength,
                        cone: s.cone.union(n.cone),
                        link: 0,
                    },
                };
                let d = joined.hi - joined.lo;
                let area = d.x * d.y + d.y * d.z + d.z * d.x;
                // The cone's solid angle, and the quarter sphere around its edge.
                let spread = 1.0 - joined.cone.angle.cos() + 0.5 * joined.cone.angle.sin();
                let cost = joined.strength * area * spread.max(1e-3);
                sum = Some(joined);
                cost
            };
            if reverse { members.iter().rev().map(step).collect() } else { members.iter().map(step).collect() }
        };
        let (left, right) = (costs(false), costs(true));
        let n = members.len();
        (1..n)
            .min_by(|&a, &b| (left[a - 1] + right[n - a - 1]).total_cmp(&(left[b - 1] + right[n - b - 1])))
            .unwrap_or(n / 2)
    }
}

fn texel(v: DVec3, w: f32) -> [f32; 4] {
    let Vec3 { x, y, z } = v.as_vec3();
    [x, y, z, w]
}

fn light_texels(light: &Light, trail: u32, depth: u32) -> [[f32; 4]; 4] {
    let trail = f32::from_bits(trail);
    let radiance = light.radiance.map(|x| x as f32);
    let color = |w: f32| [radiance[0], radiance[1], radiance[2], w];
    let depth = depth as f32;
    match light.shape {
        LightShape::Point(p) => [texel(p, 0.0), color(0.0), texel(DVec3::ZERO, trail), color(depth)],
        LightShape::Triangle([a, b, c]) => {
            let area = (b - a).cross(c - a).length() / 2.0;
            [texel(a, 1.0), texel(b, area as f32), texel(c, trail), color(depth)]
        }
        LightShape::Parallelogram([a, b, c]) => {
            let area = (b - a).cross(c - a).length();
            [texel(a, 4.0), texel(b, area as f32), texel(c, trail), color(depth)]
        }
        LightShape::Sphere { center, radius, inward } => {
            let kind = if inward { 3.0 } else { 2.0 };
            [texel(center, kind), texel(DVec3::ZERO, radius as f32), texel(DVec3::ZERO, trail), color(depth)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_light_is_at_the_end_of_its_path() {
        for count in [1usize, 2, 3, 64, 1000] {
            let lights: Vec<_> = (0..count)
                .map(|i| {
                    let x = (i * 7919 % 1000) as f64;
                    let p = DVec3::new(x, (i * 104_729 % 1000) as f64, 0.0);
                    let shape = match i % 3 {
                        0 => LightShape::Point(p),
                        1 => LightShape::Triangle([p, p + DVec3::X, p + DVec3::Y]),
                        _ => LightShape::Sphere { center: p, radius: 0.5, inward: false },
                    };
                    Light { shape, radiance: [1.0 + x, 1.0, 0.5] }
                })
                .collect();
            let table = LightTable::of(&lights);
            assert_eq!(table.nodes as usize, 2 * count - 1);
            assert!(table.depth <= 31, "{count} lights: depth {}", table.depth);
            for i in 0..count {
                let row = 3 * table.nodes as usize + 4 * i;
                let mut trail = table.texels[row + 2][3].to_bits();
                let link = |node: usize| table.texels[3 * node + 1][3].to_bits() as i32;
                let mut node = 0;
                let mut steps = 0;
                while link(node) >= 0 {
                    node = link(node) as usize + (trail & 1) as usize;
                    trail >>= 1;
                    steps += 1;
                }
                assert_eq!(link(node), !(i as i32));
                assert_eq!(table.texels[row + 3][3], steps as f32);
            }
        }
    }

    #[test]
    fn cones_contain_what_they_join() {
        let a = Cone { axis: DVec3::X, angle: 0.3 };
        let b = Cone { axis: DVec3::Y, angle: 0.1 };
        let c = a.union(b);
        for (axis, angle) in [(a.axis, a.angle), (b.axis, b.angle)] {
            assert!(c.axis.angle_between(axis) + angle <= c.angle + 1e-9);
        }
        assert!(a.union(Cone { axis: -DVec3::X, angle: 0.1 }).angle >= std::f64::consts::PI);
    }
}
