//! What an OBJ file says, as data.

use glam::DVec3;

/// Stands for an index that is not there.
pub const NONE: u32 = u32::MAX;

/// Stands for an index of a normal that the file does not have.
pub const ASTRAY: u32 = u32::MAX - 1;

/// What an OBJ file says about surfaces. Points, lines, curves, groups and smoothing groups are left out.
#[derive(Debug, Clone, Default)]
pub struct Obj {
    /// `v`, without weights.
    pub positions: Vec<DVec3>,
    /// Red, green and blue of each of `positions`, where the file has any: white for those without.
    pub colors: Vec<[f32; 3]>,
    /// `vt`; zero where a file has no finite numbers.
    pub uvs: Vec<[f32; 2]>,
    /// `vn`; zero where a file has no finite numbers.
    pub normals: Vec<DVec3>,
    /// Of all triangles, face by face.
    pub triangles: Vec<[Corner; 3]>,
    /// `f`.
    pub faces: Vec<Face>,
    /// Names that `usemtl` gave, each once, in order of first use, with the line of that.
    pub material_names: Vec<(String, u32)>,
    /// What `mtllib` names, each once, with the line.
    pub libraries: Vec<(String, u32)>,
}

/// A corner of a triangle: indices into what the file defines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Corner {
    /// Into [`Obj::positions`].
    pub position: u32,
    /// Into [`Obj::uvs`], or [`NONE`].
    pub uv: u32,
    /// Into [`Obj::normals`], or [`NONE`], or [`ASTRAY`].
    pub normal: u32,
}

/// A polygon, cut into triangles: a fan around its first corner, where that covers it once.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// At least 1.
    pub triangles: u32,
    /// Into [`Obj::material_names`]; `None` before the first `usemtl`.
    pub material: Option<u32>,
}
