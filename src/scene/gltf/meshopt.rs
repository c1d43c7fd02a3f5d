//! The decoder of EXT_meshopt_compression: its three modes and three filters, by the bitstreams that the extension defines.
//!
//! Every byte is read within bounds: data that ends too early decode to `None`.

use serde::Deserialize;

/// What the extension says of a buffer view.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: usize,
    pub count: usize,
    pub mode: Mode,
    #[serde(default)]
    pub filter: Filter,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
}

/// Elements of the attributes' largest block, and of a group.
const BLOCK_BYTES: usize = 8192;
const MOST_IN_BLOCK: usize = 256;
const GROUP: usize = 16;

impl Compressed {
    /// The bytes of the view. `None`: the data is not of the format.
    pub fn decode(&self, data: &[u8]) -> Option<Vec<u8>> {
        let mut bytes = match self.mode {
            Mode::Attributes => attributes(data, self.count, self.byte_stride)?,
            Mode::Triangles => packed(&triangles(data, self.count)?, self.byte_stride)?,
            Mode::Indices => packed(&indices(data, self.count)?, self.byte_stride)?,
        };
        match (self.filter, self.byte_stride) {
            (Filter::None, _) => {}
            (Filter::Octahedral, 4) => bytes.chunks_exact_mut(4).for_each(octahedral_8),
            (Filter::Octahedral, 8) => bytes.chunks_exact_mut(8).for_each(octahedral_16),
            (Filter::Quaternion, 8) => bytes.chunks_exact_mut(8).for_each(quaternion),
            (Filter::Exponential, stride) if stride % 4 == 0 => bytes.chunks_exact_mut(4).for_each(exponential),
            _ => return None,
        }
        Some(bytes)
    }

    /// Bytes of the view when decoded.
    pub fn decoded_length(&self) -> Option<usize> {
        self.count.checked_mul(self.byte_stride)
    }
}

/// Bytes that are read one after the other.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (&first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(first)
    }

    fn bytes(&mut self, count: usize) -> Option<&[u8]> {
        let (first, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(first)
    }

    /// An unsigned number of seven bits a byte, the lowest first.
    fn number(&mut self) -> Option<u32> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 127).checked_shl(shift)?;
            if byte < 128 {
                return Some(value);
            }
        }
        None
    }

    /// A number after `last`, by the difference from it.
    fn after(&mut self, last: u32) -> Option<u32> {
        let value = self.number()?;
        Some(last.wrapping_add((value >> 1) ^ (value & 1).wrapping_neg()))
    }
}

fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) || data.first() != Some(&0xa0) {
        return None;
    }
    // At the end stands the element before the first, after zeros if it is small.
    let tail = stride.max(32);
    let content = data.get(1..data.len().checked_sub(tail)?)?;
    let mut last = data[data.len() - stride..].to_vec();
    let mut reader = Reader(content);
    let most = ((BLOCK_BYTES / stride) & !(GROUP - 1)).min(MOST_IN_BLOCK);
    let mut decoded = Vec::new();
    while decoded.len() < count * stride {
        let elements = most.min(count - decoded.len() / stride);
        let first = decoded.len();
        decoded.resize(first + elements * stride, 0);
        for (k, last) in last.iter_mut().enumerate() {
            let deltas = deltas(&mut reader, elements)?;
            for (i, delta) in deltas.into_iter().take(elements).enumerate() {
                *last = last.wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg());
                decoded[first + i * stride + k] = *last;
            }
        }
    }
    Some(decoded)
}

/// Bytes of a block for one byte of its elements: whole groups, each of 0, 2, 4 or 8 bits a byte.
fn deltas(reader: &mut Reader<'_>, elements: usize) -> Option<Vec<u8>> {
    let groups = elements.div_ceil(GROUP);
    let widths = reader.bytes(groups.div_ceil(4))?.to_vec();
    let mut deltas = Vec::with_capacity(groups * GROUP);
    for group in 0..groups {
        match widths[group / 4] >> (2 * (group % 4)) & 3 {
            0 => deltas.extend([0; GROUP]),
            3 => deltas.extend_from_slice(reader.bytes(GROUP)?),
            width => {
                let bits = 2 * usize::from(width);
                let packed = reader.bytes(GROUP * bits / 8)?.to_vec();
                let escape = (1u8 << bits) - 1;
                for i in 0..GROUP {
                    let per = 8 / bits;
                    let value = packed[i / per] >> (8 - bits * (i % per + 1)) & escape;
                    // The highest value says that a whole byte follows the group.
                    deltas.push(if value == escape { reader.byte()? } else { value });
                }
            }
        }
    }
    Some(deltas)
}

/// What triangles refer back to.
#[derive(Default)]
struct Recent {
    edges: [[u32; 2]; 16],
    edge: usize,
    vertices: [u32; 16],
    vertex: usize,
}

impl Recent {
    fn push_vertex(&mut self, vertex: u32) {
        self.vertices[self.vertex % 16] = vertex;
        self.vertex += 1;
    }

    fn push_edge(&mut self, edge: [u32; 2]) {
        self.edges[self.edge % 16] = edge;
        self.edge += 1;
    }

    fn vertex_before(&self, back: usize) -> u32 {
        self.vertices[(self.vertex + 16 - back) % 16]
    }
}

fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let version = match data.first()? {
        0xe0 => 0,
        0xe1 => 1,
        _ => return None,
    };
    if !count.is_multiple_of(3) {
        return None;
    }
    // Vertices that are near the last one have short codes from version 1 on.
    let first_escape = if version >= 1 { 13 } else { 15 };
    let codes = data.get(1..1 + count / 3)?;
    let table = data.get(data.len().checked_sub(16)?..)?;
    let mut reader = Reader(data.get(1 + count / 3..data.len() - 16)?);
    let mut recent = Recent::default();
    let (mut next, mut last) = (0u32, 0u32);
    let mut decoded = Vec::with_capacity(count);
    for &code in codes {
        if code < 0xf0 {
            let [a, b] = recent.edges[(recent.edge + 15 - usize::from(code >> 4)) % 16];
            let low = code & 15;
            let c = if low < first_escape {
                if low == 0 { take(&mut next) } else { recent.vertex_before(1 + usize::from(low)) }
            } else {
                last = match low {
                    13 => last.wrapping_sub(1),
                    14 => last.wrapping_add(1),
                    _ => reader.after(last)?,
                };
                last
            };
            if low == 0 || low >= first_escape {
                recent.push_vertex(c);
            }
            recent.push_edge([c, b]);
            recent.push_edge([a, c]);
            decoded.extend([a, b, c]);
            continue;
        }
        let is_known = code < 0xfe;
        let pair = if is_known { table[usize::from(code & 15)] } else { reader.byte()? };
        let (of_b, of_c) = (usize::from(pair >> 4), usize::from(pair & 15));
        let is_free_a = code == 0xff;
        if !is_known && pair == 0 {
            next = 0;
        }
        let mut a = if is_free_a { 0 } else { take(&mut next) };
        let mut b = if of_b == 0 { take(&mut next) } else { recent.vertex_before(of_b) };
        let mut c = if of_c == 0 { take(&mut next) } else { recent.vertex_before(of_c) };
        if !is_known {
            for (vertex, is_free) in [(&mut a, is_free_a), (&mut b, of_b == 15), (&mut c, of_c == 15)] {
                if is_free {
                    last = reader.after(last)?;
                    *vertex = last;
                }
            }
        }
        recent.push_vertex(a);
        if of_b == 0 || (!is_known && of_b == 15) {
            recent.push_vertex(b);
        }
        if of_c == 0 || (!is_known && of_c == 15) {
            recent.push_vertex(c);
        }
        recent.push_edge([b, a]);
        recent.push_edge([c, b]);
        recent.push_edge([a, c]);
        decoded.extend([a, b, c]);
    }
    Some(decoded)
}

fn take(next: &mut u32) -> u32 {
    let vertex = *next;
    *next = next.wrapping_add(1);
    vertex
}

fn indices(data: &[u8], count: usize) -> Option<Vec<u32>> {
    if !matches!(data.first()?, 0xd0 | 0xd1) {
        return None;
    }
    let mut reader = Reader(&data[1..]);
    let mut last = [0u32; 2];
    let next = |_| {
        let value = reader.number()?;
        // The lowest bit says to which of two runs it belongs.
        let last = &mut last[(value & 1) as usize];
        let delta = value >> 1;
        *last = last.wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg());
        Some(*last)
    };
    (0..count).map(next).collect()
}

fn packed(values: &[u32], stride: usize) -> Option<Vec<u8>> {
    match stride {
        2 => values
            .iter()
            .map(|&v| u16::try_from(v).ok())
            .collect::<Option<Vec<_>>>()
            .map(|all| all.into_iter().flat_map(u16::to_le_bytes).collect()),
        4 => Some(values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        _ => None,
    }
}

/// A unit vector of an octahedron's x and y, and what stands for 1; all scaled to `most`.
fn unfolded([x, y, one]: [f32; 3], most: f32) -> [f32; 3] {
    let z = one - x.abs() - y.abs();
    // The lower half is folded outward: what lies below moves x and y back towards 0.
    let fold = z.min(0.0);
    let back = |v: f32| if v >= 0.0 { v + fold } else { v - fold };
    let (x, y) = (back(x), back(y));
    let scale = most / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| (v * scale).round())
}

fn octahedral_8(element: &mut [u8]) {
    let v = unfolded([0, 1, 2].map(|i| f32::from(element[i] as i8)), 127.0);
    (0..3).for_each(|i| element[i] = v[i] as i8 as u8);
}

fn words(element: &[u8]) -> [i16; 4] {
    [0, 2, 4, 6].map(|i| i16::from_le_bytes([element[i], element[i + 1]]))
}

fn octahedral_16(element: &mut [u8]) {
    let [x, y, one, _] = words(element).map(f32::from);
    let v = unfolded([x, y, one], 32767.0);
    (0..3).for_each(|i| element[2 * i..][..2].copy_from_slice(&(v[i] as i16).to_le_bytes()));
}

fn quaternion(element: &mut [u8]) {
    let [x, y, z, last] = words(element);
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(last | 3);
    let [x, y, z] = [x, y, z].map(|v| f32::from(v) * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (last & 3) as usize;
    for (i, v) in [w, x, y, z].into_iter().enumerate() {
        let at = (largest + i) % 4;
        element[2 * at..][..2].copy_from_slice(&((v * 32767.0).round() as i16).to_le_bytes());
    }
}

fn exponential(element: &mut [u8]) {
    let value = i32::from_le_bytes([element[0], element[1], element[2], element[3]]);
    let (mantissa, exponent) = (value << 8 >> 8, value >> 24);
    let value = f64::from(mantissa) * 2f64.powi(exponent);
    element.copy_from_slice(&(value as f32).to_le_bytes());
}
