//! From the text of an OBJ file to its triangles, by way of `tobj`.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use super::statement::{Statement, quoted, read_failed, statements};
use crate::scene::error::SceneError;

/// What an OBJ file says about surfaces. Points, lines, curves, groups and smoothing groups are left out.
#[derive(Debug, Clone, Default)]
pub struct Obj {
    /// All triangles, with indices of their own into positions, texture coordinates and normals. Of these, the ones in
    /// use are there. A corner without texture coordinates or normal has zeros, unless the file has none at all.
    pub mesh: tobj::Mesh,
    /// `f`.
    pub faces: Vec<Face>,
    /// Names that `usemtl` gave, each once, in order of first use, with the line of that.
    pub material_names: Vec<(String, u32)>,
    /// What `mtllib` names, each once, with the line.
    pub libraries: Vec<(String, u32)>,
}

/// A polygon, cut into a fan of triangles around its first corner.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// At least 1.
    pub triangles: u32,
    /// Into [`Obj::material_names`]; `None` before the first `usemtl`.
    pub material: Option<u32>,
}

/// Reads an OBJ file that is in memory. Statements that are not known are ignored.
///
/// # Errors
/// [`SceneError::Statement`] with the line of a number that is none, is not finite or exceeds 1e30, of a face with
/// fewer than three corners, and of an index that is zero or out of range.
pub fn parse_obj(bytes: &[u8], file: &str) -> Result<Obj, SceneError> {
    let mut obj = Obj::default();
    let geometry = check(bytes, file, &mut obj)?;
    // `single_index` would split the vertices, across which normals are to be averaged.
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (mut models, _) = tobj::load_obj_buf(&mut geometry.as_bytes(), &options, |_| Ok(Default::default()))
        .map_err(|error| read_failed(file, error))?;
    obj.mesh = models.pop().map(|model| model.mesh).unwrap_or_default();
    Ok(obj)
}

/// What a corner may refer to, in this order.
const KINDS: [(&str, &str); 3] = [("v", "vertex"), ("vt", "texture coordinate"), ("vn", "normal")];

/// Numbers of `v`, `vt` and `vn`.
type Counts = [i64; 3];

/// Checks all statements, takes names and faces into `obj`, and returns the others for `tobj`, plainly written:
///
/// - `v`, `vt` and `vn` without weights, by which it would divide, and colours; `f` without comments.
/// - No `o`, `g` and `usemtl`, at which it would begin a new mesh with vertices of its own.
/// - A corner without normal or texture coordinates, where others have them, would get those of the corner before. It
///   gets a stand-in: one more of the kind, at the end of the text, that is zero.
fn check(bytes: &[u8], file: &str, obj: &mut Obj) -> Result<String, SceneError> {
    let kind_of =
        |statement: &Statement<'_>| KINDS.iter().position(|(keyword, _)| keyword.as_bytes() == statement.keyword());
    let mut counts = Counts::default();
    statements(bytes).filter_map(|statement| kind_of(&statement)).for_each(|kind| counts[kind] += 1);
    let mut so_far = Counts::default();
    let mut geometry = String::with_capacity(bytes.len());
    let mut material = None;
    let mut index_of_name = HashMap::new();
    let mut libraries = HashSet::new();
    for statement in statements(bytes) {
        if let Some(kind) = kind_of(&statement) {
            so_far[kind] += 1;
            let least = if kind == 1 { 1 } else { 3 };
            let ([x, y, z], _) = statement.numbers::<3>(file, least)?;
            // Writing to a String cannot fail.
            let _ = writeln!(geometry, "{} {x} {y} {z}", KINDS[kind].0);
            continue;
        }
        match statement.keyword() {
            b"f" => {
                let triangles = check_face(&statement, file, so_far, counts, &mut geometry)?;
                obj.faces.push(Face { triangles, material });
            }
            b"usemtl" => {
                let name = statement.name();
                material = (!name.is_empty()).then(|| {
                    *index_of_name.entry(name).or_insert_with_key(|name| {
                        obj.material_names.push((name.clone(), statement.line));
                        obj.material_names.len() as u32 - 1
                    })
                });
            }
            b"mtllib" => {
                let name = statement.name();
                if libraries.insert(name.clone()) {
                    obj.libraries.push((name, statement.line));
                }
            }
            _ => {}
        }
    }
    for (kind, stand_in) in [(1, "vt 0 0\n"), (2, "vn 0 0 0\n")] {
        geometry.push_str(if counts[kind] > 0 { stand_in } else { "" });
    }
    Ok(geometry)
}

/// Returns the number of triangles. A positive index may refer to what the file defines later, a negative one may not.
fn check_face(
    statement: &Statement<'_>,
    file: &str,
    so_far: Counts,
    counts: Counts,
    geometry: &mut String,
) -> Result<u32, SceneError> {
    geometry.push('f');
    let mut corners = 0;
    for word in statement.words().skip(1) {
        corners += 1;
        let bad = || {
            let expected =
                "v, v/vt, v//vn or v/vt/vn, with indices that count from 1, or from -1 back to a vertex above";
            statement.error(file, format!("corner {corners} is {}", quoted(word)), expected)
        };
        let mut parts = word.split(|&byte| byte == b'/');
        if parts.clone().count() > KINDS.len() {
            return Err(bad());
        }
        for (kind, (_, what)) in KINDS.iter().enumerate() {
            geometry.push(if kind == 0 { ' ' } else { '/' });
            let count = counts[kind];
            let index = match parts.next().filter(|part| kind == 0 || !part.is_empty()) {
                None if count == 0 => continue,
                None => count + 1, // the stand-in
                Some(part) => match parse_index(part).ok_or_else(bad)? {
                    index if index == 0 || -index > so_far[kind] => return Err(bad()),
                    index if index > count => {
                        let expected = format!("at most {count}, the number of them in the file");
                        return Err(statement.error(file, format!("{what} {index} of a face"), expected));
                    }
                    index => index,
                },
            };
            let _ = write!(geometry, "{index}");
        }
    }
    geometry.push('\n');
    if corners < 3 {
        return Err(statement.error(file, format!("a face with {corners} corners"), "at least 3"));
    }
    Ok(corners - 2)
}

/// An index as OBJ counts, of a magnitude that a mesh can have.
fn parse_index(word: &[u8]) -> Option<i64> {
    let index: i64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    (index.unsigned_abs() < u32::MAX.into()).then_some(index)
}
