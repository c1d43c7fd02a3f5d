//! Descriptors: what the shaders of a set of pipelines see.

use std::sync::Arc;

use ash::vk;

use crate::gpu::acceleration_level::Level;
use crate::gpu::buffer::Buffer;
use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};
use crate::gpu::kept_layout::{BindingKind, KeptLayout, push_ranges};
use crate::gpu::required::most_storage_buffers;

/// What is bound.
#[derive(Clone, Copy)]
pub(crate) enum Resource<'a> {
    Buffer(&'a Buffer),
    AccelerationStructure(&'a Level),
}

impl Resource<'_> {
    fn range(self) -> vk::DescriptorBufferInfo {
        let raw = if let Self::Buffer(buffer) = self { buffer.raw } else { vk::Buffer::null() };
        vk::DescriptorBufferInfo::default().buffer(raw).range(vk::WHOLE_SIZE)
    }

    fn view(self) -> vk::BufferView {
        if let Self::Buffer(buffer) = self { buffer.view } else { vk::BufferView::null() }
    }

    fn acceleration_structure(self) -> vk::AccelerationStructureKHR {
        if let Self::AccelerationStructure(of) = self { of.raw } else { vk::AccelerationStructureKHR::null() }
    }
}

/// The bindings of a set, a resource each, and the size of the push constants: all that a pipeline has to know of what it
/// will work on.
pub(crate) struct BindingLayout {
    pub raw: vk::PipelineLayout,
    pub set: vk::DescriptorSetLayout,
    pub bindings: Vec<(u32, BindingKind)>,
    pub push_bytes: u32,
    device: Arc<Device>,
}

impl BindingLayout {
    /// The layout of the bindings' numbers and kinds, at least one.
    pub fn new(device: &Arc<Device>, bindings: &[(u32, BindingKind)], push_bytes: u32) -> Result<Arc<Self>, GpuError> {
        let arrays = bindings.iter().filter(|&&(_, kind)| kind == BindingKind::Array).count();
        debug_assert!(arrays <= most_storage_buffers(&device.limits) as usize, "devices are chosen for fewer arrays");
        let mut kept = device.layouts();
        let known = kept.iter().position(|layout| layout.bindings == bindings && layout.push_bytes == push_bytes);
        let place = match known {
            Some(place) => place,
            None => {
                kept.push(KeptLayout::new(&device.raw, bindings, push_bytes)?);
                kept.len() - 1
            }
        };
        let KeptLayout { set, raw, .. } = kept[place];
        Ok(Arc::new(Self { raw, set, bindings: bindings.to_vec(), push_bytes, device: Arc::clone(device) }))
    }

    /// The push constants, if there are any.
    pub fn push_ranges(&self) -> Vec<vk::PushConstantRange> {
        push_ranges(self.push_bytes)
    }
}

/// A descriptor set over resources.
pub(crate) struct BindingSet {
    pub layout: Arc<BindingLayout>,
    pub raw: vk::DescriptorSet,
    pool: vk::DescriptorPool,
}

impl BindingSet {
    /// Writes the descriptors: for each number of the layout its resource, in any order. These must outlive the set's use.
    pub fn new(layout: &Arc<BindingLayout>, resources: &[(u32, Resource<'_>)]) -> Result<Self, GpuError> {
        let device = &layout.device.raw;
        let count = |wanted| layout.bindings.iter().filter(|&&(_, kind)| kind == wanted).count() as u32;
        let sizes: Vec<_> = BindingKind::ALL
            .into_iter()
            .map(|kind| vk::DescriptorPoolSize { ty: kind.raw(), descriptor_count: count(kind) })
            .filter(|s| s.descriptor_count > 0)
            .collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: live device; `sizes` is not empty, since a layout has bindings, and outlives the call.
        let pool = check("vkCreateDescriptorPool", unsafe { device.create_descriptor_pool(&info, None) })?;
        let mut set = Self { layout: Arc::clone(layout), raw: vk::DescriptorSet::null(), pool };
        let set_layouts = [layout.set];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&set_layouts);
        // SAFETY: the pool was just made with this device, like the layout, and has room for this one set.
        set.raw = check("vkAllocateDescriptorSets", unsafe { device.allocate_descriptor_sets(&info) })?[0];

        let of = |number: u32| resources.iter().find(|&&(n, _)| n == number).map(|&(_, resource)| resource);
        let bound: Vec<_> = layout.bindings.iter().filter_map(|&(n, kind)| Some((n, kind, of(n)?))).collect();
        debug_assert_eq!(
            (bound.len(), bound.len()),
            (layout.bindings.len(), resources.len()),
            "each number has a resource"
        );
        let ranges: Vec<_> = bound.iter().map(|(.., resource)| [resource.range()]).collect();
        let views: Vec<_> = bound.iter().map(|(.., resource)| [resource.view()]).collect();
        let structures: Vec<_> = bound.iter().map(|(.., resource)| [resource.acceleration_structure()]).collect();
        let mut of_structures: Vec<_> = structures
            .iter()
            .map(|raw| vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(raw))
            .collect();
        let writes: Vec<_> = bound
            .iter()
            .zip(ranges.iter().zip(&views).zip(&mut of_structures))
            .map(|(&(number, kind, _), ((range, view), structure))| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set.raw)
                    .dst_binding(number)
                    .descriptor_type(kind.raw())
                    .descriptor_count(1);
                match kind {
                    BindingKind::Array | BindingKind::Values => write.buffer_info(range),
                    BindingKind::Texels | BindingKind::StorageTexels => write.texel_buffer_view(view),
                    BindingKind::AccelerationStructure => write.push_next(structure),
                }
            })
            .collect();
        // SAFETY: no submission uses the new set yet; resources are alive; what describes them outlives the call.
        unsafe { device.update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }
}

impl Drop for BindingSet {
    fn drop(&mut self) {
        let device = &self.layout.device;
        if device.is_given_up() {
            return;
        }
        // SAFETY: owners wait for the device first.
        unsafe { device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}
