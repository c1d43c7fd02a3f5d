//! Lights as the shaders see them, and the table from which one of many is chosen: see shaders/lib/light/choice.glsl.

use glam::{DVec3, Vec3};

use crate::render::light::emitter::{Light, LightShape};
use crate::render::light::grid::LightGrid;
use crate::render::light::tree::{LightTree, Link};

/// Kinds of lights (shaders/lib/light/light.glsl).
pub(crate) mod kind {
    pub const POINT: u32 = 0;
    pub const TRIANGLE: u32 = 1;
    pub const SPHERE: u32 = 2;
    pub const INWARD: u32 = 3;
    pub const PARALLELOGRAM: u32 = 4;
    /// One that is sampled by solid angle; for anything else it is a parallelogram.
    pub const RECTANGLE: u32 = 5;
    /// No kind: some surface emits on both sides, as two lights.
    pub const TWO_SIDED: u32 = 6;
    pub const SPOT: u32 = 7;
    pub const DIRECTIONAL: u32 = 8;
}

/// What the shaders see of lights.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LightTable {
    /// Nodes of a texel, then lights of four, then the grid.
    pub texels: Vec<[f32; 4]>,
    pub nodes: u32,
    pub grid: LightGrid,
    /// Kinds that there are, a bit each.
    pub kinds: u32,
    /// Of samples, regardless of what lights may contribute.
    pub even_share: f32,
}

/// From such a ratio of strengths on some samples choose lights regardless of them: a power of two, so that of stratified samples an even
/// part does.
const DIFFER_MUCH: f64 = 32.0;
const EVEN_SHARE: f32 = 1.0 / 32.0;

impl LightTable {
    /// As if there were lights of all kinds.
    pub const ALL_KINDS: u32 = (2 << kind::DIRECTIONAL) - 1;

    /// The table of lights, of which some are rectangles to be sampled by solid angle; an empty one for none.
    pub fn of(lights: &[Light], is_rectangle: impl Fn(&Light) -> bool) -> Self {
        if lights.is_empty() {
            return Self { texels: vec![[0.0; 4]], ..Self::default() };
        }
        let tree = LightTree::of(lights);
        let (grid, entries) = LightGrid::of(&tree);
        let mut texels = Vec::with_capacity(tree.nodes.len() + 4 * lights.len() + entries.len());
        let mut leaves = vec![0; lights.len()];
        let whole = tree.nodes[0].strength;
        for (i, node) in tree.nodes.iter().enumerate() {
            // Only ratios count, which must not leave the range of single precision.
            let strength = if whole > 0.0 { (node.strength / whole) as f32 } else { 0.0 };
            texels.push(match node.link {
                Link::Light(light) => {
                    leaves[light as usize] = i as u32;
                    [0.0, 0.0, strength, f32::from_bits(light)]
                }
                Link::Inner { second, end } => {
                    let first = tree.nodes[i + 1].strength;
                    let share = if node.strength > 0.0 { first / node.strength } else { 0.5 };
                    [share as f32, f32::from_bits(second), strength, f32::from_bits(!end)]
                }
            });
        }
        let mut kinds = 0;
        for (light, &leaf) in lights.iter().zip(&leaves) {
            let kind = if is_rectangle(light) { kind::RECTANGLE } else { kind_of(light) };
            kinds |= 1 << kind;
            texels.extend(light_texels(light, kind, leaf));
        }
        texels.extend(entries);
        let strengths = || lights.iter().map(Light::strength).filter(|&strength| strength > 0.0);
        let (least, most) = (strengths().fold(f64::INFINITY, f64::min), strengths().fold(0.0, f64::max));
        let even_share = if most > DIFFER_MUCH * least { EVEN_SHARE } else { 0.0 };
        Self { texels, nodes: tree.nodes.len() as u32, grid, kinds, even_share }
    }
}

fn texel(v: DVec3, w: f32) -> [f32; 4] {
    let Vec3 { x, y, z } = v.as_vec3();
    [x, y, z, w]
}

fn kind_of(light: &Light) -> u32 {
    match light.shape {
        LightShape::Point(_) => kind::POINT,
        LightShape::Spot { .. } => kind::SPOT,
        LightShape::Directional { .. } => kind::DIRECTIONAL,
        LightShape::Triangle(_) => kind::TRIANGLE,
        LightShape::Parallelogram(_) => kind::PARALLELOGRAM,
        LightShape::Sphere { inward: false, .. } => kind::SPHERE,
        LightShape::Sphere { inward: true, .. } => kind::INWARD,
    }
}

fn light_texels(light: &Light, kind: u32, leaf: u32) -> [[f32; 4]; 4] {
    let kind = kind as f32;
    let leaf = f32::from_bits(leaf);
    let radiance = light.radiance.map(|x| x as f32);
    let color = [radiance[0], radiance[1], radiance[2], f32::from_bits(light.primitive)];
    match light.shape {
        LightShape::Point(p) => [texel(p, kind), color, texel(DVec3::ZERO, leaf), color],
        LightShape::Spot { position, axis, inner, outer, range } => {
            // The part of the difference of the cosines is scale·cos + offset; of a cone of all directions it is 1.
            let scale = if outer <= -1.0 || inner <= -1.0 { 0.0 } else { 1.0 / (inner - outer).max(1e-4) };
            let offset = if scale > 0.0 { -outer * scale } else { 1.0 };
            let cone = [scale as f32, offset as f32, (1.0 / range) as f32, 0.0];
            [texel(position, kind), color, texel(axis, leaf), cone]
        }
        LightShape::Directional { axis } => [texel(-axis, kind), color, texel(DVec3::ZERO, leaf), color],
        LightShape::Triangle([a, b, c]) => {
            let area = (b - a).cross(c - a).length() / 2.0;
            [texel(a, kind), texel(b, area as f32), texel(c, leaf), color]
        }
        LightShape::Parallelogram([a, b, c]) => {
            let area = (b - a).cross(c - a).length();
            [texel(a, kind), texel(b, area as f32), texel(c, leaf), color]
        }
        LightShape::Sphere { center, radius, .. } => {
            [texel(center, kind), texel(DVec3::ZERO, radius as f32), texel(DVec3::ZERO, leaf), color]
        }
    }
}
