//! Rays through a scene, in render space, with the records of shaders/probe/{closest,occlusion,scatter}.comp.

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};
use glam::{DVec3, Vec3};

use crate::gpu::Context;
use crate::oracle::Primitive;
use crate::render::RenderSettings;
use crate::render::scene::collect::Origin;
use crate::render::scene::tables::Tables;
use crate::render::space::RenderSpace;
use crate::scene::Scene;

use crate::check::probe::{CheckError, Kernel, Probe, tables_of};

const CLOSEST: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/closest.spv"));
const OCCLUSION: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/occlusion.spv"));
const SCATTER: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/scatter.spv"));

/// Set in `self_id` for a ray that runs inside the sphere it starts on (shaders/lib/intersect/sphere.glsl).
pub(crate) const INSIDE: i32 = 0x4000_0000;

/// A ray. Origin and `t_max` are in units of render space.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct RayInput {
    pub origin: [f32; 3],
    /// Far end, for occlusion.
    pub t_max: f32,
    pub direction: [f32; 3],
    /// Handle of the surface it starts on, or −1.
    pub self_id: i32,
}

impl RayInput {
    /// A ray that starts in free space.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin: origin.to_array(), t_max: f32::INFINITY, direction: direction.to_array(), self_id: -1 }
    }
}

/// The closest hit.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct HitRecord {
    pub t: f32,
    /// Number of the primitive, or −1.
    pub id: i32,
    /// Steps through the BVH.
    pub steps: u32,
    /// Handle by which rays that leave the surface name it.
    pub self_id: i32,
    pub position: [f32; 3],
    /// Bound on the position's error along the normal.
    pub offset: f32,
}

/// Whether anything lies before `t_max`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct OcclusionRecord {
    pub hidden: u32,
    pub steps: u32,
    pub unused: [u32; 2],
}

/// A path about to trace its next ray.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct PathInput {
    pub ray: RayInput,
    pub throughput: [f32; 3],
    pub hits: u32,
    /// Normal at the start, and the density of the ray there (0: no light sampling competes).
    pub normal: [f32; 3],
    pub pdf: f32,
    /// The sample that the random numbers belong to.
    pub pixel: u32,
    pub index: u32,
    pub unused: [u32; 2],
}

impl PathInput {
    /// A path of sample `index` of `pixel` that begins with `ray`.
    pub fn new(ray: RayInput, pixel: u32, index: u32) -> Self {
        Self { ray, throughput: [1.0; 3], hits: 0, normal: [0.0; 3], pdf: 0.0, pixel, index, unused: [0; 2] }
    }
}

/// What one ray of a path met, and the path's next ray.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct PathRecord {
    pub t: f32,
    /// Number of the primitive, or −1.
    pub id: i32,
    /// 0: the path has ended, and what follows is the camera ray of the next sample.
    pub alive: u32,
    /// Light came directly from a light.
    pub lit: u32,
    /// Emitted, from the background and from lights.
    pub radiance: [f32; 3],
    pub unused: f32,
    pub throughput: [f32; 3],
    pub hits: u32,
    pub origin: [f32; 3],
    pub unused2: f32,
    pub direction: [f32; 3],
    pub self_id: i32,
    pub normal: [f32; 3],
    pub pdf: f32,
    /// The shadow ray, of length 0 if there was none to trace.
    pub shadow: RayInput,
}

impl PathRecord {
    /// The path's next ray.
    pub fn next(&self, from: &PathInput) -> PathInput {
        PathInput {
            ray: RayInput {
                origin: self.origin,
                t_max: f32::INFINITY,
                direction: self.direction,
                self_id: self.self_id,
            },
            throughput: self.throughput,
            hits: self.hits,
            normal: self.normal,
            pdf: self.pdf,
            ..*from
        }
    }
}

/// Rays through one scene.
pub(crate) struct RayProbe<I, O> {
    probe: Probe<I, O>,
    tables: Tables,
    space: RenderSpace,
    triangles: Vec<usize>,
}

impl<I: NoUninit, O: AnyBitPattern> RayProbe<I, O> {
    fn make(
        context: &Context,
        scene: &Scene,
        settings: &RenderSettings,
        spirv: &'static [u8],
        function: u32,
    ) -> Result<Self, CheckError> {
        let (space, tables) = tables_of(scene, settings);
        let kernel = Kernel::function("probe rays", spirv, function);
        let probe = Probe::new(context, kernel, scene, &tables, settings, 0)?;
        let triangles = scene.meshes.iter().map(|m| m.triangles.len()).collect();
        Ok(Self { probe, tables, space, triangles })
    }

    /// Runs over all inputs.
    pub fn run(&mut self, inputs: &[I]) -> Result<Vec<O>, CheckError> {
        self.probe.run(inputs)
    }

    /// Render-space units in a scene unit.
    pub fn scale(&self) -> f64 {
        self.space.length(1.0)
    }

    /// A point of render space in the scene, exactly where the camera is the scene's origin.
    pub fn scene_point(&self, p: [f32; 3]) -> DVec3 {
        self.space.scene_point(DVec3::from(p.map(f64::from)))
    }

    /// Deepest leaf of the BVH; 0 without a BVH.
    pub fn bvh_depth(&self) -> u32 {
        self.tables.bvh.map_or(0, |t| t.depth)
    }

    /// The oracle's name for the surface that a ray leaves, as for [`Self::primitive`].
    pub fn surface_left(&self, self_id: i32) -> Option<Primitive> {
        self.primitive(self.tables.primitive_of(self_id & !INSIDE))
    }

    /// The oracle's name for a primitive; `None` for a miss, and for polygons, which may join triangles.
    pub fn primitive(&self, id: i32) -> Option<Primitive> {
        match self.tables.origin_of(id)? {
            Origin::Sphere(i) => Some(Primitive::Sphere(i)),
            Origin::Triangle(mut i) => {
                for (mesh, &count) in self.triangles.iter().enumerate() {
                    if i < count {
                        return Some(Primitive::Triangle(mesh, i));
                    }
                    i -= count;
                }
                None
            }
        }
    }
}

impl RayProbe<RayInput, HitRecord> {
    /// Closest hits.
    pub fn closest(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, CheckError> {
        Self::make(context, scene, settings, CLOSEST, 0)
    }

    /// Closest polygons, by the exact test alone.
    pub fn closest_polygons(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, CheckError> {
        Self::make(context, scene, settings, CLOSEST, 1)
    }
}

impl RayProbe<RayInput, OcclusionRecord> {
    /// Occlusion.
    pub fn occluded(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, CheckError> {
        Self::make(context, scene, settings, OCCLUSION, 0)
    }
}

impl RayProbe<PathInput, PathRecord> {
    /// One hit of a path each.
    pub fn scatter(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, CheckError> {
        Self::make(context, scene, settings, SCATTER, 0)
    }
}
