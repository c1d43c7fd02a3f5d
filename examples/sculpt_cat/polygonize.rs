//! Marching tetrahedra on a body-centred cubic lattice, then relaxation of the vertices along the surface.
//!
//! A tetrahedron has no ambiguous case, and neighbours share whole faces, so the mesh is closed and 2-manifold whatever
//! the field (Doi and Koide, "An efficient method of triangulating equi-valued surfaces by using tetrahedral cells", 1991).
//! The tetrahedra of the body-centred lattice are nearly regular: two centres of neighbouring cells and an edge of the
//! face between them (Labelle and Shewchuk, "Isosurface stuffing", 2007).

use crate::field::gradient;
use glam::{DVec3, IVec3, ivec3};
use std::collections::HashMap;

/// An indexed triangle mesh; counter-clockwise from outside.
#[derive(Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// Three indices into `positions` each.
    pub triangles: Vec<[u32; 3]>,
}

/// The sampling lattice: cubes of edge `spacing` that fill a box, each lattice point moved by `warp`.
///
/// The warp makes cells smaller where detail is; it must be one-to-one and orientation-preserving.
pub struct Lattice<W> {
    /// Lower corner of the box, before the warp.
    pub lower: DVec3,
    /// Edge of a cube, before the warp.
    pub spacing: f64,
    /// Cubes along x, y and z.
    pub cells: IVec3,
    /// Where a point of the regular lattice goes.
    pub warp: W,
}

impl<W: Fn(DVec3) -> DVec3> Lattice<W> {
    /// Position of a lattice point; coordinates count half cubes: corners are all even, centres all odd.
    fn position(&self, point: IVec3) -> DVec3 {
        (self.warp)(self.lower + point.as_dvec3() * (0.5 * self.spacing))
    }
}

/// A lattice point and the field there.
#[derive(Clone, Copy)]
struct Sample {
    point: IVec3,
    position: DVec3,
    value: f64,
}

/// Triangulates the zero set of `field` inside the lattice.
pub fn march<W: Fn(DVec3) -> DVec3>(field: &impl Fn(DVec3) -> f64, lattice: &Lattice<W>) -> Mesh {
    let mut samples = HashMap::new();
    let mut sample = |point: IVec3| {
        *samples.entry(point).or_insert_with(|| {
            let position = lattice.position(point);
            Sample { point, position, value: field(position) }
        })
    };
    let mut surface = Surface::default();
    let axes = [ivec3(1, 0, 0), ivec3(0, 1, 0), ivec3(0, 0, 1)];
    for z in 0..lattice.cells.z {
        for y in 0..lattice.cells.y {
            for x in 0..lattice.cells.x {
                let center = ivec3(2 * x + 1, 2 * y + 1, 2 * z + 1);
                for i in 0..3 {
                    let (along, u, v) = (axes[i], axes[(i + 1) % 3], axes[(i + 2) % 3]);
                    let (near, far) = (sample(center), sample(center + 2 * along));
                    let face = center + along;
                    let ring = [face - u - v, face + u - v, face + u + v, face - u + v].map(&mut sample);
                    for k in 0..4 {
                        surface.add_tetrahedron([near, far, ring[k], ring[(k + 1) % 4]]);
                    }
                }
            }
        }
    }
    surface.mesh
}

/// A mesh under construction: one vertex for each lattice edge that crosses the surface.
#[derive(Default)]
struct Surface {
    mesh: Mesh,
    vertex_of_edge: HashMap<(IVec3, IVec3), u32>,
}

impl Surface {
    /// Adds the surface inside a positively oriented tetrahedron.
    fn add_tetrahedron(&mut self, t: [Sample; 4]) {
        // Even permutations that bring a corner, or a pair of corners, to the front.
        const ONE: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 0, 2, 1]];
        const TWO: [[usize; 4]; 6] =
            [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];
        let inside = t.map(|s| s.value < 0.0);
        match inside.iter().filter(|&&i| i).count() {
            1 => {
                if let Some([a, b, c, d]) = ONE.into_iter().find(|o| inside[o[0]]) {
                    let [ab, ac, ad] = [b, c, d].map(|o| self.vertex(t[a], t[o]));
                    self.mesh.triangles.push([ab, ac, ad]);
                }
            }
            3 => {
                if let Some([a, b, c, d]) = ONE.into_iter().find(|o| !inside[o[0]]) {
                    let [ab, ac, ad] = [b, c, d].map(|o| self.vertex(t[a], t[o]));
                    self.mesh.triangles.push([ab, ad, ac]);
                }
            }
            2 => {
                if let Some([a, b, c, d]) = TWO.into_iter().find(|o| inside[o[0]] && inside[o[1]]) {
                    let quad = [(a, c), (a, d), (b, d), (b, c)].map(|(i, o)| self.vertex(t[i], t[o]));
                    self.add_quad(quad);
                }
            }
            _ => {}
        }
    }

    /// Splits along the shorter diagonal.
    fn add_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let length = |i: u32, j: u32| self.mesh.positions[i as usize].distance_squared(self.mesh.positions[j as usize]);
        let halves = if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        self.mesh.triangles.extend(halves);
    }

    /// The vertex where the lattice edge from `a` to `b` crosses the surface, by linear interpolation.
    fn vertex(&mut self, a: Sample, b: Sample) -> u32 {
        // The same end first whichever tetrahedron asks.
        let (a, b) = if a.point.to_array() < b.point.to_array() { (a, b) } else { (b, a) };
        let positions = &mut self.mesh.positions;
        *self.vertex_of_edge.entry((a.point, b.point)).or_insert_with(|| {
            positions.push(a.position.lerp(b.position, a.value / (a.value - b.value)));
            (positions.len() - 1) as u32
        })
    }
}

/// Evens out the triangles: each round moves every vertex towards the mean of its neighbours within the tangent plane,
/// then back onto the surface by Newton steps along the gradient.
pub fn relax(mesh: &mut Mesh, field: &impl Fn(DVec3) -> f64, rounds: usize) {
    let neighbours = neighbours(mesh);
    for _ in 0..rounds {
        let moved = mesh.positions.iter().zip(&neighbours).map(|(&p, around)| {
            let mean = around.iter().map(|&n| mesh.positions[n as usize]).sum::<DVec3>() / around.len() as f64;
            let normal = gradient(field, p).normalize_or_zero();
            let step = mean - p;
            project(field, p + 0.5 * (step - normal * step.dot(normal)))
        });
        mesh.positions = moved.collect();
    }
}

/// Indices of the vertices that share an edge with each vertex.
fn neighbours(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); mesh.positions.len()];
    for t in &mesh.triangles {
        for k in 0..3 {
            // The opposite triangle contributes the reverse edge.
            neighbours[t[k] as usize].push(t[(k + 1) % 3]);
        }
    }
    neighbours
}

/// Brings `p` onto the surface: Newton's method along the gradient.
fn project(field: &impl Fn(DVec3) -> f64, mut p: DVec3) -> DVec3 {
    for _ in 0..2 {
        let slope = gradient(field, p);
        // A blend can have a flat spot inside the solid; the floor keeps the step finite there.
        p -= slope * (field(p) / slope.length_squared().max(0.1));
    }
    p
}
