//! Buffers, their memory, and texel views of them.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};
use crate::gpu::select::DeviceKind;

/// What a buffer is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Usage {
    /// Read and written by shaders; on the device.
    Storage,
    /// A few numbers that shaders read; on the device. (Vulkan allows at least 16 KiB.)
    Values,
    /// Read by shaders through a typed view; on the device.
    Texel,
    /// Read and written by shaders through a typed view, or as an array of numbers; on the device, and mapped where that is a CPU.
    StorageTexelAndArray,
    /// Written by shaders through a typed view or as an array of numbers, read by the host: in the host's memory, to which a device with its
    /// own writes over a bus.
    HostTexelAndArray,
    /// Written by the host, source of copies.
    Upload,
    /// Read by the host, destination of copies.
    Readback,
    /// Written by the host, read where an acceleration structure is built.
    BuildInput,
    /// An acceleration structure; on the device.
    AccelerationStructure,
    /// For the builder of an acceleration structure; on the device.
    Scratch,
}

impl Usage {
    /// Whether shaders may see it as an array.
    fn is_array(self) -> bool {
        matches!(self, Self::Storage | Self::StorageTexelAndArray | Self::HostTexelAndArray)
    }

    /// Whether shaders may see it as texels.
    fn is_texel(self) -> bool {
        matches!(self, Self::Texel | Self::StorageTexelAndArray | Self::HostTexelAndArray)
    }
}

/// Of all typed views: 16 bytes, as bits.
const TEXEL: vk::Format = vk::Format::R32G32B32A32_UINT;

/// A buffer that owns its memory and, for texel buffers, its view.
pub(crate) struct Buffer {
    pub raw: vk::Buffer,
    pub view: vk::BufferView,
    pub bytes: u64,
    /// Whether the host reads it where it is. Memory of the device may be mapped too, but slow to read.
    host_reads: bool,
    allocation: Option<Allocation>,
    device: Arc<Device>,
}

impl Buffer {
    /// Makes a buffer of at least one 16-byte element.
    ///
    /// # Errors
    /// It exceeds a limit of the device, or there is no memory for it.
    pub fn new(device: &Arc<Device>, name: &str, bytes: u64, usage: Usage) -> Result<Self, GpuError> {
        let bytes = bytes.max(16).next_multiple_of(16);
        let too_large = |limit: u64, kind: &'static str| GpuError::TooLarge {
            what: name.to_owned(),
            bytes,
            limit,
            kind,
            device: device.info.name.clone(),
        };
        let (array, texel) = (usage.is_array(), usage.is_texel());
        if array && bytes > device.info.max_storage_range {
            return Err(too_large(device.info.max_storage_range, "storage buffer"));
        }
        if texel && bytes / 16 > device.info.max_texel_elements {
            return Err(too_large(device.info.max_texel_elements.saturating_mul(16), "texel buffer"));
        }
        let (flags, location) = match usage {
            Usage::Storage => (
                vk::BufferUsageFlags::STORAGE_BUFFER
                    | vk::BufferUsageFlags::TRANSFER_SRC
                    | vk::BufferUsageFlags::TRANSFER_DST,
                MemoryLocation::GpuOnly,
            ),
            Usage::Values => {
                (vk::BufferUsageFlags::UNIFORM_BUFFER | vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuOnly)
            }
            Usage::Texel => (
                vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
                MemoryLocation::GpuOnly,
            ),
            Usage::HostTexelAndArray => (
                vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER | vk::BufferUsageFlags::STORAGE_BUFFER,
                MemoryLocation::GpuToCpu,
            ),
            Usage::StorageTexelAndArray => {
                // There the host reads what shaders wrote where it is.
                let on_host = device.info.kind == DeviceKind::Cpu;
                (
                    vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER
                        | vk::BufferUsageFlags::STORAGE_BUFFER
                        | vk::BufferUsageFlags::TRANSFER_SRC
                        | vk::BufferUsageFlags::TRANSFER_DST,
                    if on_host { MemoryLocation::GpuToCpu } else { MemoryLocation::GpuOnly },
                )
            }
            Usage::Upload => (vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu),
            Usage::Readback => (vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu),
            Usage::BuildInput => (
                vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
                    | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
                MemoryLocation::CpuToGpu,
            ),
            Usage::AccelerationStructure => (
                vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
                MemoryLocation::GpuOnly,
            ),
            Usage::Scratch => (
                vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
                MemoryLocation::GpuOnly,
            ),
        };
        let info = vk::BufferCreateInfo::default().size(bytes).usage(flags);
        let no_memory = |reason: String| GpuError::OutOfMemory { what: format!("{name} ({bytes} bytes)"), reason };
        // SAFETY: a live device; the size is not 0.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.map_err(|e| no_memory(e.to_string()))?;
        let host_reads = location == MemoryLocation::GpuToCpu;
        let device_of = Arc::clone(device);
        let mut buffer =
            Self { raw, view: vk::BufferView::null(), bytes, host_reads, allocation: None, device: device_of };
        device.name(raw, name);
        // SAFETY: `raw` was just made with this device.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        {
            let mut memory = device.memory();
            let allocation = memory
                .allocator
                .allocate(&AllocationCreateDesc {
                    name,
                    requirements,
                    location,
                    linear: true,
                    allocation_scheme: AllocationScheme::GpuAllocatorManaged,
                })
                .map_err(|e| no_memory(e.to_string()))?;
            memory.bytes += allocation.size();
            memory.peak = memory.peak.max(memory.bytes);
            let bound = unsafe {
                // SAFETY: the allocation was made for this buffer's requirements and is not bound yet.
                device.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset())
            };
            buffer.allocation = Some(allocation);
            bound.map_err(|e| no_memory(e.to_string()))?;
        }
        if texel {
            let view = vk::BufferViewCreateInfo::default().buffer(raw).format(TEXEL).range(vk::WHOLE_SIZE);
            // SAFETY: the buffer is bound and has the texel usage; the range was checked above.
            buffer.view = check("vkCreateBufferView", unsafe { device.raw.create_buffer_view(&view, None) })?;
            device.name(buffer.view, name);
        }
        Ok(buffer)
    }

    /// Where it is on the device, if it is for acceleration structures.
    pub fn address(&self) -> u64 {
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.raw);
        // SAFETY: the buffer is bound, and was made with the usage; the device has the feature where such buffers are made.
        unsafe { self.device.raw.get_buffer_device_address(&info) }
    }

    /// The mapped bytes, if the host is to read them.
    pub fn mapped(&self) -> Option<&[u8]> {
        let allocation = self.allocation.as_ref().filter(|_| self.host_reads)?;
        allocation.mapped_slice().map(|s| &s[..self.bytes as usize])
    }

    /// The mapped bytes for writing, where the memory is visible to the host.
    pub fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        let bytes = self.bytes as usize;
        self.allocation.as_mut()?.mapped_slice_mut().map(|s| &mut s[..bytes])
    }

    /// Makes the system hand out memory that the host reads where it is, which it does when it is first touched.
    pub fn touch(&mut self) {
        if self.host_reads
            && let Some(bytes) = self.mapped_mut()
        {
            bytes.fill(0);
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if self.device.is_given_up() {
            return;
        }
        // SAFETY: owners wait for the device before they drop buffers that a submission uses.
        unsafe {
            if self.view != vk::BufferView::null() {
                self.device.raw.destroy_buffer_view(self.view, None);
            }
            self.device.raw.destroy_buffer(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            let mut memory = self.device.memory();
            memory.bytes -= allocation.size();
            if let Err(error) = memory.allocator.free(allocation) {
                log::error!("freeing device memory: {error}");
            }
        }
    }
}
