//! Numbers of accessors: any type of component, stride, normalised integers, sparse values, and views that are not there.

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;

use crate::scene::error::SceneError;
use crate::scene::gltf::document::Document;

/// Most elements of an accessor without a view, which are zeros: a number costs the file nothing.
const MOST_ZEROS: u64 = 1 << 24;

/// The numbers of an accessor, element by element.
struct Elements {
    /// Components of an element.
    width: usize,
    kind: ComponentType,
    normalized: bool,
    /// Little-endian components, without gaps.
    bytes: Vec<u8>,
}

impl Elements {
    fn component(&self, index: usize) -> f64 {
        let size = self.kind.size();
        let bytes = &self.bytes[index * size..][..size];
        let word = |n: usize| bytes.get(n).copied().unwrap_or(0);
        let (value, most) = match self.kind {
            ComponentType::I8 => (f64::from(word(0) as i8), 127.0),
            ComponentType::U8 => (f64::from(word(0)), 255.0),
            ComponentType::I16 => (f64::from(i16::from_le_bytes([word(0), word(1)])), 32767.0),
            ComponentType::U16 => (f64::from(u16::from_le_bytes([word(0), word(1)])), 65535.0),
            ComponentType::U32 => {
                (f64::from(u32::from_le_bytes([word(0), word(1), word(2), word(3)])), 4_294_967_295.0)
            }
            ComponentType::F32 => return f64::from(f32::from_le_bytes([word(0), word(1), word(2), word(3)])),
        };
        if self.normalized { (value / most).max(-1.0) } else { value }
    }
}

impl Document<'_> {
    /// Vectors of `N` numbers. Accessors of fewer components than that leave the rest at `missing`.
    pub fn vectors<const N: usize>(
        &self,
        index: usize,
        at: &str,
        types: &[Type],
        missing: f64,
    ) -> Result<Vec<[f64; N]>, SceneError> {
        let elements = self.elements(index, at, types)?;
        let count = elements.bytes.len() / (elements.kind.size() * elements.width).max(1);
        let vector = |i: usize| {
            std::array::from_fn(
                |k| if k < elements.width { elements.component(i * elements.width + k) } else { missing },
            )
        };
        Ok((0..count).map(vector).collect())
    }

    /// Whole numbers: indices.
    pub fn indices(&self, index: usize, at: &str) -> Result<Vec<u32>, SceneError> {
        let elements = self.elements(index, at, &[Type::Scalar])?;
        if matches!(elements.kind, ComponentType::F32 | ComponentType::I8 | ComponentType::I16) {
            return Err(self.error(at, format!("indices of type {:?}", elements.kind), "unsigned integers"));
        }
        let count = elements.bytes.len() / elements.kind.size();
        Ok((0..count).map(|i| elements.component(i) as u32).collect())
    }

    fn elements(&self, index: usize, at: &str, types: &[Type]) -> Result<Elements, SceneError> {
        let accessor = self.get(&self.root.accessors, index, "accessor", at)?;
        let at = format!("{at}, accessor {index}");
        let (Checked::Valid(component), Checked::Valid(kind)) = (accessor.component_type, accessor.type_) else {
            return Err(self.error(at, "an unknown type", "a type of the specification"));
        };
        if !types.contains(&kind) {
            return Err(self.error(at, format!("{kind:?}"), format!("{types:?}")));
        }
        let width = kind.multiplicity();
        let kind = component.0;
        let size = width * kind.size();
        let count = accessor.count.0;
        let mut bytes = match accessor.buffer_view {
            Some(view) => self.strided(accessor, view.value(), size, &at)?,
            None if count <= MOST_ZEROS => vec![0; count as usize * size],
            None => {
                return Err(self.error(
                    at,
                    format!("{count} elements without a bufferView"),
                    format!("at most {MOST_ZEROS}"),
                ));
            }
        };
        self.replace_sparse(accessor, size, &mut bytes, &at)?;
        Ok(Elements { width, kind, normalized: accessor.normalized, bytes })
    }

    /// The elements of a view, without gaps.
    fn strided(&self, accessor: &Accessor, view: usize, size: usize, at: &str) -> Result<Vec<u8>, SceneError> {
        let bytes = self.view_content(view, at)?;
        let stride = self.stride(view).unwrap_or(size);
        let first = accessor.byte_offset.map_or(0, |offset| offset.0);
        let count = accessor.count.0;
        let needed = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride as u64)?.checked_add(size as u64)?.checked_add(first));
        if stride < size || needed.is_none_or(|needed| needed > bytes.len() as u64) {
            let found = format!("{count} elements of {size} bytes, {stride} apart, from byte {first} on");
            return Err(self.error(
                at,
                found,
                format!("elements within the {} bytes of bufferView {view}", bytes.len()),
            ));
        }
        let bytes = &bytes[(first as usize).min(bytes.len())..];
        if stride == size {
            return Ok(bytes[..count as usize * size].to_vec());
        }
        Ok((0..count as usize).flat_map(|i| &bytes[i * stride..][..size]).copied().collect())
    }

    fn replace_sparse(&self, accessor: &Accessor, size: usize, bytes: &mut [u8], at: &str) -> Result<(), SceneError> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let at = format!("{at}, sparse");
        let count = sparse.count.0;
        let Checked::Valid(kind) = sparse.indices.component_type else {
            return Err(self.error(at, "an unknown type of index", "an unsigned integer"));
        };
        let part = |view: usize, offset: u64, width: usize| {
            let content = self.view_content(view, &at)?;
            let needed = count.checked_mul(width as u64).and_then(|n| n.checked_add(offset));
            match needed.filter(|&needed| needed <= content.len() as u64) {
                Some(_) => Ok(content[offset as usize..].to_vec()),
                None => Err(self.error(&at, format!("{count} elements"), format!("elements within bufferView {view}"))),
            }
        };
        let indices = part(sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0, kind.0.size())?;
        let values = part(sparse.values.buffer_view.value(), sparse.values.byte_offset.0, size)?;
        let indices = Elements { width: 1, kind: kind.0, normalized: false, bytes: indices };
        for i in 0..count as usize {
            let index = indices.component(i) as usize;
            let Some(to) = bytes.get_mut(index.saturating_mul(size)..).and_then(|rest| rest.get_mut(..size)) else {
                return Err(self.error(at, format!("index {index}"), format!("one below {}", accessor.count.0)));
            };
            to.copy_from_slice(&values[i * size..][..size]);
        }
        Ok(())
    }
}
