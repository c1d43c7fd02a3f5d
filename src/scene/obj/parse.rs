//! From the text of an OBJ file to its triangles. Large files are read by several threads, each its own lines.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use crate::scene::error::SceneError;
use crate::scene::obj::model::{ASTRAY, Corner, Face, NONE, Obj};
use crate::scene::obj::polygon::cut_concave;
use crate::scene::obj::statement::{Lines, Statement, decoded, quoted, split_lines};

/// Least bytes for a task of its own, and tasks for each thread, at most: lines of one kind take longer than those of another.
const CHUNK: usize = 1 << 18;
const TASKS: usize = 16;

/// Reads an OBJ file that is in memory. Statements that are not known are ignored.
///
/// # Errors
/// [`SceneError::Statement`] with the line of a vertex of a face whose numbers are none, are not finite or exceed 1e30, of a face
/// with fewer than three corners, and of an index of a vertex that is zero or out of range.
pub fn parse_obj(bytes: &[u8], file: &str) -> Result<Obj, SceneError> {
    let bytes = decoded(bytes);
    parse_in(split_lines(&bytes, (bytes.len() / CHUNK).min(TASKS * rayon::current_num_threads())), file)
}

fn parse_in(chunks: Vec<Lines<'_>>, file: &str) -> Result<Obj, SceneError> {
    let counts: Vec<Counts> = chunks.par_iter().map(|chunk| count(chunk.clone())).collect();
    let total = counts.iter().fold(Counts::default(), |sum, c| sum.and(*c));
    let before = counts.iter().scan(Counts::default(), |sum, c| {
        let before = *sum;
        *sum = sum.and(*c);
        Some(before)
    });
    let work: Vec<_> = chunks.into_iter().zip(before).collect();
    let parts: Vec<_> = work.into_par_iter().map(|(lines, before)| Part::parse(lines, before, total, file)).collect();
    // The first part that is wrong holds the first line that is.
    let parts = parts.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut joined = Joined::of(&parts);
    parts.into_iter().for_each(|part| joined.append(part));
    if let Some(error) = joined.first_bad_vertex_in_use() {
        return Err(error);
    }
    cut_concave(&mut joined.obj);
    Ok(joined.obj)
}

/// Of vertices without a colour in files that have some.
const WHITE: [f32; 3] = [1.0; 3];

/// What a corner may refer to: keywords.
const KINDS: [&[u8]; 3] = [b"v", b"vn", b"vt"];

fn kind_of(keyword: &[u8]) -> Option<usize> {
    KINDS.iter().position(|kind| *kind == keyword)
}

/// Numbers of `v`, `vn` and `vt`.
#[derive(Debug, Clone, Copy, Default)]
struct Counts([i64; KINDS.len()]);

impl Counts {
    fn and(self, other: Self) -> Self {
        Self(std::array::from_fn(|kind| self.0[kind] + other.0[kind]))
    }
}

fn count(lines: Lines<'_>) -> Counts {
    let mut counts = Counts::default();
    lines.filter_map(|statement| kind_of(statement.keyword())).for_each(|kind| counts.0[kind] += 1);
    counts
}

/// Which material faces have: of the part before, none, or one of this part's names.
#[derive(Clone, Copy)]
enum Material {
    Inherited,
    None,
    Named(u32),
}

/// What a run of lines says, with indices that are those of the whole file but for materials.
struct Part {
    obj: Obj,
    /// Faces of `obj` have no material yet: those up to the given one have this.
    materials: Vec<(usize, Material)>,
    /// Vertices whose numbers are none that can be used, which have others: the index of each among those of the part, and why.
    bad_vertices: Vec<(u32, SceneError)>,
}

impl Part {
    fn parse(lines: Lines<'_>, before: Counts, total: Counts, file: &str) -> Result<Self, SceneError> {
        let mut obj = Obj::default();
        let mut materials = Vec::new();
        let mut material = Material::Inherited;
        let mut index_of_name = HashMap::new();
        let mut corners = Vec::new();
        let mut bad_vertices = Vec::new();
        for statement in lines {
            match statement.keyword() {
                b"v" => {
                    let (position, color) = read_vertex(&statement, file).unwrap_or_else(|error| {
                        bad_vertices.push((obj.positions.len() as u32, error));
                        ([0.0; 3], None)
                    });
                    if color.is_some() || !obj.colors.is_empty() {
                        obj.colors.resize(obj.positions.len(), WHITE);
                        obj.colors.push(color.unwrap_or(WHITE));
                    }
                    obj.positions.push(position.into());
                }
                b"vt" => {
                    let [u, v] = statement.numbers::<2>(file, 1).unwrap_or_default();
                    obj.uvs.push([u as f32, v as f32]);
                }
                b"vn" => obj.normals.push(statement.numbers::<3>(file, 3).unwrap_or_default().into()),
                b"f" => {
                    let here = [obj.positions.len(), obj.normals.len(), obj.uvs.len()].map(|n| n as i64);
                    read_face(&statement, file, before.and(Counts(here)), total, &mut corners)?;
                    obj.triangles.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
                    obj.faces.push(Face { triangles: corners.len() as u32 - 2, material: None });
                }
                b"usemtl" => {
                    materials.push((obj.faces.len(), material));
                    material = match statement.name() {
                        name if name.is_empty() => Material::None,
                        name => Material::Named(*index_of_name.entry(name).or_insert_with_key(|name| {
                            obj.material_names.push((name.clone(), statement.line));
                            obj.material_names.len() as u32 - 1
                        })),
                    };
                }
                b"mtllib" => obj.libraries.push((statement.name(), statement.line)),
                _ => {}
            }
        }
        materials.push((obj.faces.len(), material));
        Ok(Self { obj, materials, bad_vertices })
    }
}

/// A position, and a colour if there are three more numbers behind it.
fn read_vertex(statement: &Statement<'_>, file: &str) -> Result<([f64; 3], Option<[f32; 3]>), SceneError> {
    match statement.numbers_from::<6>(1, 3) {
        Ok(([x, y, z, r, g, b], count)) => Ok(([x, y, z], (count == 6).then_some([r, g, b].map(|c| c as f32)))),
        // What follows a position may be anything.
        Err(_) => statement.numbers::<3>(file, 3).map(|position| (position, None)),
    }
}

/// Reads the corners of a face. A positive index may refer to what the file defines later, a negative one may not.
fn read_face(
    statement: &Statement<'_>,
    file: &str,
    so_far: Counts,
    total: Counts,
    corners: &mut Vec<Corner>,
) -> Result<(), SceneError> {
    corners.clear();
    for word in statement.words().skip(1) {
        let number = corners.len() + 1;
        let bad = || {
            let expected =
                "v, v/vt, v//vn or v/vt/vn, with indices that count from 1, or from -1 back to a vertex above";
            statement.error(file, format!("corner {number} is {}", quoted(word)), expected)
        };
        let mut parts = word.split(|&byte| byte == b'/');
        let (vertex, uv, normal) = (parts.next().unwrap_or_default(), parts.next(), parts.next());
        if parts.next().is_some() {
            return Err(bad());
        }
        let [vertices, normals, uvs] = total.0;
        let position = match index(vertex, so_far.0[0], vertices) {
            Index::Of(index) => index,
            Index::Beyond(index) => {
                let expected = format!("at most {vertices}, the number of them in the file");
                return Err(statement.error(file, format!("vertex {index} of a face"), expected));
            }
            Index::None => return Err(bad()),
        };
        let normal = match normal.filter(|part| !part.is_empty()).map(|part| index(part, so_far.0[1], normals)) {
            Some(Index::Of(index)) => index,
            Some(_) => ASTRAY,
            None => NONE,
        };
        let uv = match uv.map(|part| index(part, so_far.0[2], uvs)) {
            Some(Index::Of(index)) => index,
            _ => NONE,
        };
        corners.push(Corner { position, uv, normal });
    }
    if corners.len() < 3 {
        return Err(statement.error(file, format!("a face with {} corners", corners.len()), "at least 3"));
    }
    Ok(())
}

/// What an index of a corner refers to.
enum Index {
    /// This, counted from 0.
    Of(u32),
    /// One that the file does not have: as the file counts.
    Beyond(i64),
    /// Nothing: zero, no number, or farther back than the file goes.
    None,
}

/// Reads an index, where `above` elements are defined before it, and `count` in all.
fn index(word: &[u8], above: i64, count: i64) -> Index {
    let index: Option<i64> = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    // Of a magnitude that a mesh can have.
    match index.filter(|index| index.unsigned_abs() < ASTRAY.into()) {
        Some(index) if index > count => Index::Beyond(index),
        Some(index) if index > 0 => Index::Of((index - 1) as u32),
        Some(index) if index < 0 && -index <= above => Index::Of((above + index) as u32),
        _ => Index::None,
    }
}

/// The parts so far, put together.
#[derive(Default)]
struct Joined {
    obj: Obj,
    /// Of the last face and of those to come.
    material: Option<u32>,
    index_of_name: HashMap<String, u32>,
    libraries: HashSet<String>,
    /// Of the file's vertices, in order.
    bad_vertices: Vec<(u32, SceneError)>,
}

impl Joined {
    /// None yet, with room for all of these, unless there is only one.
    fn of(parts: &[Part]) -> Self {
        let mut joined = Self::default();
        if parts.len() > 1 {
            let sum = |length: fn(&Obj) -> usize| parts.iter().map(|part| length(&part.obj)).sum();
            let obj = &mut joined.obj;
            obj.positions.reserve_exact(sum(|obj| obj.positions.len()));
            obj.normals.reserve_exact(sum(|obj| obj.normals.len()));
            obj.uvs.reserve_exact(sum(|obj| obj.uvs.len()));
            obj.triangles.reserve_exact(sum(|obj| obj.triangles.len()));
            obj.faces.reserve_exact(sum(|obj| obj.faces.len()));
        }
        joined
    }

    fn append(&mut self, part: Part) {
        let Part { obj: mut from, materials, bad_vertices } = part;
        let before = self.obj.positions.len() as u32;
        self.bad_vertices.extend(bad_vertices.into_iter().map(|(index, error)| (before + index, error)));
        let names: Vec<u32> = from.material_names.into_iter().map(|(name, line)| self.name(name, line)).collect();
        let mut first = 0;
        for (end, material) in materials {
            self.material = match material {
                Material::Inherited => self.material,
                Material::None => None,
                Material::Named(local) => Some(names[local as usize]),
            };
            from.faces[first..end].iter_mut().for_each(|face| face.material = self.material);
            first = end;
        }
        for (name, line) in from.libraries {
            if self.libraries.insert(name.clone()) {
                self.obj.libraries.push((name, line));
            }
        }
        if !self.obj.colors.is_empty() || !from.colors.is_empty() {
            from.colors.resize(from.positions.len(), WHITE);
            self.obj.colors.resize(before as usize, WHITE);
            self.obj.colors.append(&mut from.colors);
        }
        append(&mut self.obj.positions, from.positions);
        append(&mut self.obj.uvs, from.uvs);
        append(&mut self.obj.normals, from.normals);
        append(&mut self.obj.triangles, from.triangles);
        append(&mut self.obj.faces, from.faces);
    }

    /// Why the first vertex cannot be used that cannot be, but that a face has.
    fn first_bad_vertex_in_use(&mut self) -> Option<SceneError> {
        if self.bad_vertices.is_empty() {
            return None;
        }
        let corners = self.obj.triangles.as_flattened();
        let used: HashSet<u32> = corners
            .par_iter()
            .map(|corner| corner.position)
            .filter(|position| self.bad_vertices.binary_search_by_key(position, |(index, _)| *index).is_ok())
            .collect();
        let bad_vertices = std::mem::take(&mut self.bad_vertices);
        bad_vertices.into_iter().find(|(index, _)| used.contains(index)).map(|(_, error)| error)
    }

    fn name(&mut self, name: String, line: u32) -> u32 {
        *self.index_of_name.entry(name).or_insert_with_key(|name| {
            self.obj.material_names.push((name.clone(), line));
            self.obj.material_names.len() as u32 - 1
        })
    }
}

fn append<T>(to: &mut Vec<T>, mut from: Vec<T>) {
    if to.capacity() == 0 {
        *to = from;
    } else {
        to.append(&mut from);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Statements whose meaning depends on those before them.
    const TEXT: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5\nvn 0 0 1\nf 1 2 3\nusemtl red\nf 1/1 2/1 3/1\n\
        v 1 1 \\\n 0 .5 0 1\nvt 1 2\nf -1 -2 -3 -4\n# f 9 9 9 \\\nusemtl\nf 4//1 1//-1 2//1\nusemtl blue\nmtllib a.mtl\nmtllib b.mtl\n\
        f 5 1 2\nv 2 2 2\nusemtl red\nf 1 2 3\n";

    #[test]
    fn any_cut_between_lines_gives_the_same() {
        let whole = parse_in(split_lines(TEXT.as_bytes(), 1), "a.obj").unwrap();
        assert_eq!((whole.positions.len(), whole.triangles.len(), whole.faces.len()), (5, 7, 6));
        let materials: Vec<_> = whole.faces.iter().map(|f| f.material).collect();
        assert_eq!(materials, [None, Some(0), Some(0), None, Some(1), Some(0)]);
        assert_eq!(whole.positions[3], DVec3::new(1.0, 1.0, 0.0));
        let last = whole.triangles[2].map(|c| c.position);
        assert_eq!(last, [3, 2, 1]);
        assert_eq!((&whole.colors[3..], whole.uvs.len()), (&[[0.5, 0.0, 1.0], [1.0; 3]][..], 2));
        for count in 2..40 {
            let cut = parse_in(split_lines(TEXT.as_bytes(), count), "a.obj").unwrap();
            assert_eq!(format!("{cut:?}"), format!("{whole:?}"), "{count} parts");
        }
    }

    #[test]
    fn the_first_wrong_line_is_the_one_that_is_named() {
        let text = TEXT.replace("f 5 1 2", "f 6 1 2").replace("v 2 2 2", "v 2 2 x");
        for count in [1, 3, 17] {
            let error = parse_in(split_lines(text.as_bytes(), count), "a.obj").unwrap_err().to_string();
            assert!(error.contains("20"), "{error}");
        }
    }
}
