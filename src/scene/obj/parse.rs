//! From the text of an OBJ file to its vertices and polygons, as they are written.

use std::collections::{HashMap, HashSet};

use glam::{DVec2, DVec3};

use super::statement::{Statement, quoted, statements};
use crate::scene::error::{Location, SceneError};

/// What an OBJ file says about surfaces. Points, lines, curves, groups and smoothing groups are left out.
#[derive(Debug, Clone, Default)]
pub struct Obj {
    /// `v`, in the file's order; the weight or colour that may follow is ignored.
    pub positions: Vec<DVec3>,
    /// `vt`.
    pub texcoords: Vec<DVec2>,
    /// `vn`, of any length.
    pub normals: Vec<DVec3>,
    /// The corners of all faces, one face after the other. Indices are in range.
    pub corners: Vec<Corner>,
    /// `f`.
    pub faces: Vec<Face>,
    /// Names that `usemtl` gave, each once, in order of first use, with the line of that.
    pub material_names: Vec<(String, u32)>,
    /// What `mtllib` names, each once, with the line.
    pub libraries: Vec<(String, u32)>,
}

/// A corner of a face: indices that count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Corner {
    /// Into [`Obj::positions`].
    pub position: u32,
    /// Into [`Obj::texcoords`], or [`Corner::NONE`].
    pub texcoord: u32,
    /// Into [`Obj::normals`], or [`Corner::NONE`].
    pub normal: u32,
}

impl Corner {
    /// Stands for an index that the file does not give.
    pub const NONE: u32 = u32::MAX;
}

/// A polygon.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// Into [`Obj::corners`]: one past the face's last corner. Its first is where the face before ends.
    pub end: usize,
    /// Into [`Obj::material_names`]; `None` before the first `usemtl`.
    pub material: Option<u32>,
    /// Line in the file, counted from 1.
    pub line: u32,
}

impl Obj {
    /// The faces with their corners (at least three).
    pub fn polygons(&self) -> impl Iterator<Item = (&Face, &[Corner])> {
        let mut start = 0;
        self.faces.iter().map(move |face| (face, &self.corners[std::mem::replace(&mut start, face.end)..face.end]))
    }
}

/// Reads an OBJ file that is in memory. Statements that are not known are ignored.
///
/// # Errors
/// [`SceneError::Statement`] with the line of a number that is none, is not finite or exceeds 1e30, of a face with
/// fewer than three corners, and of an index that is zero or out of range.
pub fn parse_obj(bytes: &[u8], file: &str) -> Result<Obj, SceneError> {
    let mut obj = Obj::default();
    let mut material = None;
    let mut index_of_name = HashMap::new();
    let mut libraries = HashSet::new();
    for statement in statements(bytes) {
        match statement.keyword() {
            b"v" => obj.positions.push(DVec3::from(statement.numbers::<3>(file, 3)?.0)),
            b"vt" => obj.texcoords.push(DVec2::from(statement.numbers::<2>(file, 1)?.0)),
            b"vn" => obj.normals.push(DVec3::from(statement.numbers::<3>(file, 3)?.0)),
            b"f" => read_face(&statement, file, material, &mut obj)?,
            b"usemtl" => {
                let name = statement.name();
                material = if name.is_empty() {
                    None
                } else if let Some(&index) = index_of_name.get(name.as_ref()) {
                    Some(index)
                } else {
                    let index = obj.material_names.len() as u32;
                    obj.material_names.push((name.to_string(), statement.line));
                    index_of_name.insert(name.into_owned(), index);
                    Some(index)
                };
            }
            b"mtllib" => {
                let name = statement.name().into_owned();
                if libraries.insert(name.clone()) {
                    obj.libraries.push((name, statement.line));
                }
            }
            _ => {}
        }
    }
    // A positive index may name a vertex that the file defines later.
    check_indices(&obj, file)?;
    Ok(obj)
}

fn read_face(statement: &Statement<'_>, file: &str, material: Option<u32>, obj: &mut Obj) -> Result<(), SceneError> {
    let start = obj.corners.len();
    for word in statement.words().skip(1) {
        let corner = parse_corner(word, obj).ok_or_else(|| {
            let found = format!("corner {} is {}", obj.corners.len() - start + 1, quoted(word));
            let expected =
                "v, v/vt, v//vn or v/vt/vn, with indices that count from 1, or from -1 back to a vertex above";
            statement.error(file, found, expected)
        })?;
        obj.corners.push(corner);
    }
    let count = obj.corners.len() - start;
    if count < 3 {
        return Err(statement.error(file, format!("a face with {count} corners"), "at least 3"));
    }
    obj.faces.push(Face { end: obj.corners.len(), material, line: statement.line });
    Ok(())
}

fn parse_corner(word: &[u8], obj: &Obj) -> Option<Corner> {
    let mut parts = word.split(|&byte| byte == b'/');
    let position = parse_index(parts.next()?, obj.positions.len())?;
    let mut optional = |count| match parts.next() {
        None | Some(b"") => Some(Corner::NONE),
        Some(part) => parse_index(part, count),
    };
    let texcoord = optional(obj.texcoords.len())?;
    let normal = optional(obj.normals.len())?;
    parts.next().is_none().then_some(Corner { position, texcoord, normal })
}

/// An index as OBJ counts, from 1, or backwards from -1, made to count from 0.
fn parse_index(word: &[u8], count_so_far: usize) -> Option<u32> {
    let index: i64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    let from_zero = if index < 0 { i64::try_from(count_so_far).ok()?.checked_add(index)? } else { index - 1 };
    u32::try_from(from_zero).ok().filter(|&index| index != Corner::NONE)
}

fn check_indices(obj: &Obj, file: &str) -> Result<(), SceneError> {
    for (face, corners) in obj.polygons() {
        for corner in corners {
            let indices = [
                ("vertex", corner.position, obj.positions.len()),
                ("texture coordinate", corner.texcoord, obj.texcoords.len()),
                ("normal", corner.normal, obj.normals.len()),
            ];
            for (what, index, count) in indices {
                if index != Corner::NONE && index as usize >= count {
                    return Err(SceneError::Statement {
                        at: Location::line(file, face.line),
                        found: format!("{what} {} of a face", u64::from(index) + 1),
                        expected: format!("at most {count}, the number of them in the file").into(),
                    });
                }
            }
        }
    }
    Ok(())
}
