//! `assets/meshes/cat.obj` (made by the example `sculpt_cat`) is a closed, consistently oriented surface.
//! Renders of glass and every comparison against brute force rely on that.

use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Vertices minus edges plus faces: 2 − 2g for one component of genus g. On each side a fore paw and a hind paw touch,
/// which closes a loop around the gap below the belly: two handles.
const EULER_CHARACTERISTIC: i64 = -2;

struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
}

impl Mesh {
    /// Reads the two OBJ statements that the example writes, and refuses others.
    fn cat() -> Self {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/meshes/cat.obj");
        let text = std::fs::read_to_string(path).expect("cat.obj is part of the repository");
        let mut mesh = Self { positions: Vec::new(), triangles: Vec::new() };
        for (number, line) in text.lines().enumerate() {
            let words: Vec<_> = line.split_ascii_whitespace().collect();
            match words[..] {
                ["v", x, y, z] => mesh.positions.push(DVec3::from_array([x, y, z].map(|w| w.parse().unwrap()))),
                ["f", a, b, c] => mesh.triangles.push([a, b, c].map(|w| w.parse::<usize>().unwrap() - 1)),
                ["#", ..] | ["o", _] => {}
                _ => panic!("line {}: unexpected `{line}`", number + 1),
            }
        }
        mesh
    }

    fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.triangles.iter().map(|t| t.map(|i| self.positions[i]))
    }

    fn directed_edges(&self) -> impl Iterator<Item = (usize, usize)> {
        self.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
    }

    /// Signed volume by the divergence theorem: positive where triangles are counter-clockwise from outside.
    fn volume(&self) -> f64 {
        self.corners().map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }
}

#[test]
fn closed_and_consistently_oriented() {
    let mesh = Mesh::cat();
    let mut count = HashMap::new();
    for edge in mesh.directed_edges() {
        *count.entry(edge).or_insert(0) += 1;
    }
    for (&(a, b), &times) in &count {
        assert_eq!(times, 1, "directed edge {a}→{b}");
        assert!(count.contains_key(&(b, a)), "edge {a}→{b} has no opposite");
    }
}

/// Around each vertex the triangles form one fan; with closed edges this makes the surface a 2-manifold.
#[test]
fn one_fan_around_each_vertex() {
    let mesh = Mesh::cat();
    let mut next_around = vec![HashMap::new(); mesh.positions.len()];
    for &[a, b, c] in &mesh.triangles {
        for (i, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
            next_around[i].insert(from, to);
        }
    }
    for (vertex, next) in next_around.iter().enumerate() {
        let start = *next.keys().next().unwrap_or_else(|| panic!("vertex {vertex} is in no triangle"));
        let mut at = next[&start];
        let mut length = 1;
        while at != start {
            at = next[&at];
            length += 1;
        }
        assert_eq!(length, next.len(), "vertex {vertex} joins several fans");
    }
}

#[test]
fn one_component_of_known_genus() {
    let mesh = Mesh::cat();
    let edges = mesh.directed_edges().filter(|(a, b)| a < b).count();
    let euler = mesh.positions.len() as i64 - edges as i64 + mesh.triangles.len() as i64;
    assert_eq!(euler, EULER_CHARACTERISTIC);

    let mut neighbours = vec![Vec::new(); mesh.positions.len()];
    for (a, b) in mesh.directed_edges() {
        neighbours[a].push(b);
    }
    let mut reached = HashSet::from([0]);
    let mut frontier = vec![0];
    while let Some(a) = frontier.pop() {
        frontier.extend(neighbours[a].iter().copied().filter(|&b| reached.insert(b)));
    }
    assert_eq!(reached.len(), mesh.positions.len());
}

#[test]
fn size_and_pose() {
    let mesh = Mesh::cat();
    assert!((15_000..=40_000).contains(&mesh.triangles.len()), "{} triangles", mesh.triangles.len());
    let low = mesh.positions.iter().copied().reduce(DVec3::min).unwrap();
    let high = mesh.positions.iter().copied().reduce(DVec3::max).unwrap();
    assert_eq!((low.y, high.y), (0.0, 1.0));
    // Coordinates have five decimals.
    assert!((low + high).abs().x < 1.5e-5 && (low + high).abs().z < 1.5e-5, "not centred: {low} to {high}");
    assert!(high.x < 0.5 && high.z < 0.5, "{low} to {high}");
    // The tail makes the box wide; the body fills about a fifth of it. Reversed triangles would give a negative volume.
    let fraction = mesh.volume() / (high - low).element_product();
    assert!((0.15..0.40).contains(&fraction), "encloses {fraction} of its bounding box");
}

/// Slivers would make poor normals: each triangle has an area and no angle below ten degrees.
#[test]
fn no_degenerate_triangle() {
    let mesh = Mesh::cat();
    for (index, [a, b, c]) in mesh.corners().enumerate() {
        let double_area = (b - a).cross(c - a).length();
        assert!(double_area > 1e-8, "triangle {index}: doubled area {double_area:e}");
        for (p, q, r) in [(a, b, c), (b, c, a), (c, a, b)] {
            let angle = (q - p).angle_between(r - p).to_degrees();
            assert!(angle > 10.0, "triangle {index}: angle of {angle}°");
        }
    }
}
