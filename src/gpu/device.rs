//! The logical device with its compute queue and memory allocator.

use std::ffi::{CStr, CString};
use std::mem::{ManuallyDrop, forget};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::time::Duration;

use ash::{ext, khr, vk};
use gpu_allocator::AllocationSizes;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use crate::gpu::capture::{Capture, Captures};
use crate::gpu::error::{GpuError, check};
use crate::gpu::instance::{Instance, Validation};
use crate::gpu::kept_layout::KeptLayout;
use crate::gpu::messages::Messages;
use crate::gpu::pipeline_pool::PipelinePool;
use crate::gpu::raw_pipeline::RawPipeline;
use crate::gpu::ray_query;
use crate::gpu::ray_query::{RayQueries, RayQueryUse};
use crate::gpu::reconvergence;
use crate::gpu::required;
use crate::gpu::select;
use crate::gpu::select::{DeviceInfo, DeviceKind};
use crate::gpu::shader_objects::ShaderObjects;
use crate::gpu::subgroups;
use crate::gpu::timestamps::Timestamps;

/// How long a wait may last before the device is given up.
pub(super) const WAIT_LIMIT: Duration = Duration::from_secs(600);

const PORTABILITY: &CStr = khr::portability_subset::NAME;

/// How to make a [`Context`].
#[derive(Debug, Clone, Default)]
pub struct ContextOptions {
    /// Index, UUID or part of the name of the device; `None`: the best one.
    pub device: Option<String>,
    /// Validation layers.
    pub validation: Validation,
    /// A folder, made if it is not there, in which to keep shaders: as the driver has compiled them, if it is one that compiles them
    /// slowly each time that a program starts and can hand them over (lavapipe from Mesa 23.1 on), else as the driver gets them.
    pub shader_folder: Option<PathBuf>,
    /// Whether the device is opened for [`Accel::RayQuery`](crate::render::Accel::RayQuery) and its like, if it has ray queries.
    pub ray_query: RayQueryUse,
    /// Keep what the driver is given, see [`Context::take_capture`].
    pub capture: bool,
}

/// A Vulkan device that is ready to compute. Cheap to clone; the device lives until the last clone,
/// and the last object made with it, are gone. Until then it keeps the last eight pipelines that
/// renderers had, for the next of their kind.
#[derive(Clone)]
pub struct Context(pub(crate) Arc<Device>);

impl Context {
    /// Loads Vulkan, picks a device and opens it.
    ///
    /// # Errors
    /// No loader, no device, an unsuitable device, or a failed Vulkan call.
    pub fn new(options: &ContextOptions) -> Result<Self, GpuError> {
        Ok(Self(Arc::new(Device::new(options, Messages::default())?)))
    }

    /// The same device opened once more, with an instance, a queue and messages of its own.
    ///
    /// # Errors
    /// As for [`Context::new`].
    pub fn reopen(&self) -> Result<Self, GpuError> {
        Self::new(&self.options_for(self.info().index.to_string()))
    }

    /// Another device, by index, UUID or part of the name, under the same validation, whose messages join those of this one.
    ///
    /// # Errors
    /// As for [`Context::new`].
    pub fn open_beside(&self, device: &str) -> Result<Self, GpuError> {
        Ok(Self(Arc::new(Device::new(&self.options_for(device.to_owned()), self.messages().clone())?)))
    }

    fn options_for(&self, device: String) -> ContextOptions {
        ContextOptions {
            device: Some(device),
            validation: self.validation(),
            shader_folder: self.0.shader_folder.clone(),
            ray_query: self.0.ray_query_use,
            capture: self.0.captures.is_some(),
        }
    }

    /// The devices that Vulkan reports, and which of them [`Context::new`] would pick for `wanted`, with the reason.
    ///
    /// # Errors
    /// No loader, or enumeration failed. A failed choice is in the inner result.
    #[allow(clippy::type_complexity)]
    pub fn devices(wanted: Option<&str>) -> Result<(Vec<DeviceInfo>, Result<(usize, String), GpuError>), GpuError> {
        let instance = Instance::new(Validation::Off, Messages::default())?;
        let devices: Vec<_> = select::enumerate(&instance)?.into_iter().map(|(_, info)| info).collect();
        let choice = select::pick(&devices, wanted);
        Ok((devices, choice))
    }

    /// The device in use.
    pub fn info(&self) -> &DeviceInfo {
        &self.0.info
    }

    /// Why this device was picked.
    pub fn choice(&self) -> &str {
        &self.0.choice
    }

    /// Messages of the validation layers so far; always empty with [`Validation::Off`].
    pub fn messages(&self) -> &Messages {
        &self.0.instance.messages
    }

    /// Version of Vulkan that the validation layer knows, if there is one.
    pub fn validation_layer(&self) -> Option<(u32, u32, u32)> {
        let parts = |v| (vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v));
        self.0.instance.layer_version.map(parts)
    }

    /// Which validation runs.
    pub fn validation(&self) -> Validation {
        self.0.instance.validation
    }

    /// Whether it can be asked ray queries.
    ///
    /// # Errors
    /// The device lacks them, or was not opened for them.
    pub fn check_ray_queries(&self) -> Result<(), GpuError> {
        self.0.ray_queries().map(drop)
    }

    /// What the driver was given since this was last asked: nothing without [`ContextOptions::capture`].
    pub fn take_capture(&self) -> Capture {
        self.0.captures.as_ref().map(Captures::take).unwrap_or_default()
    }

    /// Bytes of device memory in use, and the most that were in use at one time.
    pub fn memory(&self) -> (u64, u64) {
        let memory = self.0.memory();
        (memory.bytes, memory.peak)
    }
}

/// The allocator and what it has handed out.
pub(crate) struct Memory {
    // Dropped by hand, before the device.
    pub allocator: ManuallyDrop<Allocator>,
    pub bytes: u64,
    pub peak: u64,
}

/// Device, queue, allocator.
pub(crate) struct Device {
    pub raw: ash::Device,
    /// Submissions of several threads take turns, as Vulkan demands ("externally synchronized").
    queue: Mutex<vk::Queue>,
    pub queue_family: u32,
    pub info: DeviceInfo,
    pub choice: String,
    /// What the queue's timestamps say, if it has any.
    pub timestamps: Option<Timestamps>,
    pub limits: vk::PhysicalDeviceLimits,
    names: Option<ext::debug_utils::Device>,
    /// Where shaders are kept on disk.
    pub shader_folder: Option<PathBuf>,
    /// Whether lanes that have parted are promised to be together again.
    pub reconverges: bool,
    /// Whether it was to be opened for ray queries, which it may lack.
    ray_query_use: RayQueryUse,
    ray_queries: Option<RayQueries>,
    /// Shaders without pipelines, kept there as the driver hands them over.
    pub shader_objects: Option<Arc<ShaderObjects>>,
    /// What the driver was given, if that is wanted.
    pub captures: Option<Captures>,
    /// After how many iterations the driver ends loops, once that was probed.
    pub(super) loop_limit: OnceLock<Option<u32>>,
    /// Pipelines that nobody has at the moment.
    pub(super) pipelines: PipelinePool<RawPipeline>,
    layouts: Mutex<Vec<KeptLayout>>,
    memory: Mutex<Memory>,
    given_up: AtomicBool,
    pub instance: Instance,
}

impl Device {
    fn new(options: &ContextOptions, messages: Messages) -> Result<Self, GpuError> {
        let instance = Instance::new(options.validation, messages)?;
        let devices = select::enumerate(&instance)?;
        let infos: Vec<_> = devices.iter().map(|(_, info)| info.clone()).collect();
        let (index, choice) = select::pick(&infos, options.device.as_deref())?;
        let (physical, info) = devices[index].clone();
        log::info!("device {index}: {} [{}], {choice}", info.name, info.driver);

        let queue_family = select::compute_queue_family(&instance, physical)
            .ok_or_else(|| GpuError::Unsuitable { device: info.name.clone(), missing: "a compute queue".to_owned() })?;
        // SAFETY: `physical` comes from this instance.
        let (properties, families) = unsafe {
            (
                instance.raw.get_physical_device_properties(physical),
                instance.raw.get_physical_device_queue_family_properties(physical),
            )
        };
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
        // The layer can only put checks into shaders that it sees.
        let kept = options.shader_folder.as_deref().filter(|_| options.validation != Validation::GpuAssisted);
        let store = kept.and_then(|f| ShaderObjects::find(&instance, physical, &info, f));
        let reconverges = reconvergence::is_promised(&instance, physical);
        let make = |with_ray_queries: bool| {
            let mut extensions = Vec::new();
            let mut features12 = required::features();
            let mut features_objects = vk::PhysicalDeviceShaderObjectFeaturesEXT::default().shader_object(true);
            let mut features_reconvergence =
                vk::PhysicalDeviceShaderMaximalReconvergenceFeaturesKHR::default().shader_maximal_reconvergence(true);
            let mut features_subgroups =
                vk::PhysicalDeviceSubgroupSizeControlFeatures::default().subgroup_size_control(true);
            let mut features_queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
            let mut features_structures =
                vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
            features12.buffer_device_address = vk::Bool32::from(with_ray_queries);
            let mut create = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut features12);
            if store.is_some() {
                extensions.extend(ShaderObjects::EXTENSIONS.map(CStr::as_ptr));
                create = create.push_next(&mut features_objects);
            }
            if reconverges {
                extensions.push(reconvergence::EXTENSION.as_ptr());
                create = create.push_next(&mut features_reconvergence);
            }
            if info.pins_subgroups {
                extensions.push(subgroups::EXTENSION.as_ptr());
                create = create.push_next(&mut features_subgroups);
            }
            // Who does not do all that Vulkan asks for (MoltenVK) wants to be told that this is known.
            if instance.has_extension(physical, PORTABILITY) {
                extensions.push(PORTABILITY.as_ptr());
            }
            if with_ray_queries {
                extensions.extend(ray_query::EXTENSIONS.map(CStr::as_ptr));
                create = create.push_next(&mut features_queries).push_next(&mut features_structures);
            }
            let create = create.enabled_extension_names(&extensions);
            // SAFETY: the queue family exists, and `select` has checked the features.
            check("vkCreateDevice", unsafe { instance.raw.create_device(physical, &create, None) })
        };
        let mut limits = info.ray_query.filter(|_| options.ray_query.applies_to(info.kind == DeviceKind::Cpu));
        let raw = match make(limits.is_some()) {
            // Some drivers tell of ray queries, and then fail.
            Err(error) if limits.take().is_some() => {
                log::warn!("device {index} is opened without ray queries, with which it cannot be: {error}");
                make(false)?
            }
            made => made?,
        };
        // SAFETY: the queue was asked for above.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        let ray_queries = limits.map(|limits| RayQueries::on(&instance, &raw, limits));
        let shader_objects = store.map(|store| Arc::new(store.on(&instance, &raw)));
        let names =
            (instance.validation != Validation::Off).then(|| ext::debug_utils::Device::new(&instance.raw, &raw));

        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: ray_queries.is_some(),
            // Small blocks: a scene of a few kilobytes should not hold hundreds of megabytes.
            allocation_sizes: AllocationSizes::new(16 << 20, 16 << 20),
        });
        let allocator = match allocator {
            Ok(allocator) => allocator,
            Err(error) => {
                // SAFETY: nothing else was made with the device.
                unsafe { raw.destroy_device(None) };
                return Err(GpuError::OutOfMemory { what: "the allocator".to_owned(), reason: error.to_string() });
            }
        };
        let valid_bits = families[queue_family as usize].timestamp_valid_bits;
        Ok(Self {
            raw,
            queue: Mutex::new(queue),
            queue_family,
            info,
            choice,
            timestamps: Timestamps::of(valid_bits, properties.limits.timestamp_period),
            limits: properties.limits,
            names,
            shader_folder: options.shader_folder.clone(),
            reconverges,
            ray_query_use: options.ray_query,
            ray_queries,
            shader_objects,
            captures: options.capture.then(Captures::default),
            loop_limit: OnceLock::new(),
            pipelines: PipelinePool::default(),
            layouts: Mutex::default(),
            memory: Mutex::new(Memory { allocator: ManuallyDrop::new(allocator), bytes: 0, peak: 0 }),
            given_up: AtomicBool::new(false),
            instance,
        })
    }

    /// What builds acceleration structures.
    ///
    /// # Errors
    /// The device lacks ray queries, or was not opened for them.
    pub fn ray_queries(&self) -> Result<&RayQueries, GpuError> {
        let missing = match self.ray_query_use.applies_to(self.info.kind == DeviceKind::Cpu) {
            true => "ray queries (the features rayQuery, accelerationStructure and bufferDeviceAddress)",
            false => "ray queries, for which it was not opened (ContextOptions::ray_query)",
        };
        let unsuitable = || GpuError::Unsuitable { device: self.info.name.clone(), missing: missing.to_owned() };
        self.ray_queries.as_ref().ok_or_else(unsuitable)
    }

    /// Layouts that have been made.
    pub(super) fn layouts(&self) -> MutexGuard<'_, Vec<KeptLayout>> {
        self.layouts.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    pub fn memory(&self) -> MutexGuard<'_, Memory> {
        self.memory.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Gives the device up: nobody knows what of its work it has done, and it may be at it for good. So nobody waits for it any
    /// more, and nothing that belongs to it is destroyed, itself included: the system takes it back when the process ends.
    pub fn give_up(self: &Arc<Self>) {
        if !self.given_up.swap(true, Ordering::Relaxed) {
            // With this it outlives all others.
            forget(Arc::clone(self));
        }
    }

    /// Whether it has been given up: what was made with it is then left as it is.
    pub fn is_given_up(&self) -> bool {
        self.given_up.load(Ordering::Relaxed)
    }

    /// Fails if it has been given up.
    pub fn check_in_use(&self) -> Result<(), GpuError> {
        let late = GpuError::Timeout { what: "an earlier submission", limit: WAIT_LIMIT };
        if self.is_given_up() { Err(late) } else { Ok(()) }
    }

    /// Submits to the queue, unless the device has been given up.
    ///
    /// # Safety
    /// As for `vkQueueSubmit`: everything that `submit` names is alive until its work is done.
    pub unsafe fn submit(&self, submit: &[vk::SubmitInfo<'_>]) -> Result<(), GpuError> {
        self.check_in_use()?;
        let queue = self.queue.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        // SAFETY: the caller's; the lock is the synchronization of the queue.
        check("vkQueueSubmit", unsafe { self.raw.queue_submit(*queue, submit, vk::Fence::null()) })
    }

    /// Gives a Vulkan object a name for validation messages and debuggers.
    pub fn name(&self, handle: impl vk::Handle, name: &str) {
        if let (Some(names), Ok(text)) = (&self.names, CString::new(name)) {
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&text);
            // SAFETY: the handle belongs to this device. A failure to name an object harms nothing.
            let _ = unsafe { names.set_debug_utils_object_name(&info) };
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let layouts = std::mem::take(&mut *self.layouts());
        let memory = self.memory.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
        // SAFETY: every object made with the device holds a clone of its Arc, so that none is left but for layouts and the pipelines
        // to spare, which nobody has; the allocator is dropped once, before the device whose memory it frees.
        unsafe {
            self.pipelines.take_all().into_iter().for_each(|pipeline| pipeline.destroy(&self.raw));
            layouts.into_iter().for_each(|layout| layout.destroy(&self.raw));
            ManuallyDrop::drop(&mut memory.allocator);
            self.raw.destroy_device(None);
        }
    }
}
