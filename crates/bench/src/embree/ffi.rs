//! Calls into a shared library of Embree, API 3 or 4: the only `unsafe` code of the workspace.
//!
//! What is used is declared here by hand from the interface's documentation: handles are opaque pointers, enums are C
//! ints, and packets have the layout of [`crate::packet`]. Everything outside of this file is safe: a [`Scene`] owns
//! its device, the library stays loaded, its buffers are filled before they are committed, and packets are of the
//! size and alignment that the interface asks for.
#![allow(
    unsafe_code,
    reason = "a C library has no safe interface; the safe one is made here"
)]

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::path::Path;
use std::ptr::{NonNull, null};
use std::sync::Arc;

use libloading::Library;

use crate::packet::{Packet, Rays, Valid};

type Handle = *mut c_void;

/// Geometry of triangles.
const TRIANGLE: c_int = 0;
/// Buffers of indices and of vertices, and their formats: three u32, three f32.
const INDEX_BUFFER: c_int = 0;
const VERTEX_BUFFER: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
/// Scene flag: conservative traversal and watertight intersection.
const ROBUST: c_int = 1 << 2;
/// Flag of coherent rays in API 3 and in API 4.
const COHERENT_3: c_int = 1;
const COHERENT_4: c_int = 1 << 16;
/// Device properties: the version as one number, 40403 for 4.4.3; whether packets of 8 and 16 are native.
const VERSION: c_int = 0;
const NATIVE_8: c_int = 33;
const NATIVE_16: c_int = 34;

/// `RTCIntersectContext` of API 3, with room for several levels of instances.
#[repr(C)]
struct Context3 {
    flags: c_int,
    filter: *const c_void,
    instances: [c_uint; 16],
}

/// `RTCIntersectArguments` and `RTCOccludedArguments` of API 4, with room for an optional width.
#[repr(C)]
struct Arguments4 {
    flags: c_int,
    features: c_uint,
    context: *const c_void,
    filter: *const c_void,
    callback: *const c_void,
    spare: [c_uint; 4],
}

type NewDevice = unsafe extern "C" fn(*const c_char) -> Handle;
type OfHandle = unsafe extern "C" fn(Handle);
type Property = unsafe extern "C" fn(Handle, c_int) -> isize;
type LastError = unsafe extern "C" fn(Handle) -> c_int;
type NewScene = unsafe extern "C" fn(Handle) -> Handle;
type SetOption = unsafe extern "C" fn(Handle, c_int);
type NewGeometry = unsafe extern "C" fn(Handle, c_int) -> Handle;
type NewBuffer = unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
type Attach = unsafe extern "C" fn(Handle, Handle) -> c_uint;
/// API 3: mask, scene, context, packet. API 4: mask, scene, packet, arguments.
type Query = unsafe extern "C" fn(*const c_int, Handle, *mut c_void, *mut c_void);

struct Functions {
    new_device: NewDevice,
    release_device: OfHandle,
    device_property: Property,
    device_error: LastError,
    new_scene: NewScene,
    release_scene: OfHandle,
    set_scene_quality: SetOption,
    set_scene_flags: SetOption,
    commit_scene: OfHandle,
    new_geometry: NewGeometry,
    release_geometry: OfHandle,
    set_geometry_quality: SetOption,
    commit_geometry: OfHandle,
    new_buffer: NewBuffer,
    attach: Attach,
    /// For packets of 4, 8 and 16.
    intersect: [Query; 3],
    occluded: [Query; 3],
}

/// A loaded library.
pub(super) struct Embree {
    functions: Functions,
    /// 3 or 4.
    major: isize,
    version: isize,
    /// Rays of the widest packet that is not taken apart: 16, 8 or 4.
    width: usize,
}

impl Embree {
    /// Opens a library by path, or by a name that the system looks for.
    pub(super) fn open(name: &Path) -> Result<Self, String> {
        // SAFETY: loading runs the initialisers of the library. Whoever names one trusts it, as with any program.
        let library = unsafe { Library::new(name) }.map_err(|error| error.to_string())?;
        let functions = Functions::of(&library).map_err(|error| error.to_string())?;
        // Never unloaded: its threads may outlive every device, and their code must not go from under them.
        std::mem::forget(library);
        let mut embree = Self {
            functions,
            major: 0,
            version: 0,
            width: 4,
        };
        let device = embree.device(1)?;
        // SAFETY: `device` is a live handle of this library.
        let property = |name| unsafe { (embree.functions.device_property)(device.as_ptr(), name) };
        let version = property(VERSION);
        let width = match (property(NATIVE_16), property(NATIVE_8)) {
            (1, _) => 16,
            (_, 1) => 8,
            _ => 4,
        };
        // SAFETY: as above; nobody else has this device.
        unsafe { (embree.functions.release_device)(device.as_ptr()) };
        (embree.version, embree.width) = (version, width);
        embree.major = embree.version / 10_000;
        if embree.major == 3 || embree.major == 4 {
            Ok(embree)
        } else {
            Err(format!("version {} is neither 3 nor 4", embree.version))
        }
    }

    /// Rays of its packets.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Its version, for instance 4.4.1.
    pub(super) fn version(&self) -> String {
        let (minor, patch) = (self.version / 100 % 100, self.version % 100);
        format!("{}.{minor}.{patch}", self.major)
    }

    fn device(&self, threads: usize) -> Result<NonNull<c_void>, String> {
        let config = CString::new(format!("threads={threads}")).map_err(|error| error.to_string())?;
        // SAFETY: the string ends with a zero and outlives the call.
        NonNull::new(unsafe { (self.functions.new_device)(config.as_ptr()) })
            .ok_or_else(|| "no device".to_owned())
    }

    fn check(&self, device: NonNull<c_void>, what: &str) -> Result<(), String> {
        // SAFETY: `device` is a live handle of this library.
        match unsafe { (self.functions.device_error)(device.as_ptr()) } {
            0 => Ok(()),
            error => Err(format!("error {error} {what}")),
        }
    }
}

impl Functions {
    fn of(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: the types above are those of the interface, the same in API 3 and 4 up to the meaning of two
        // pointers of `Query`; a library whose functions are used is never unloaded.
        unsafe {
            Ok(Self {
                new_device: *library.get::<NewDevice>("rtcNewDevice")?,
                release_device: *library.get::<OfHandle>("rtcReleaseDevice")?,
                device_property: *library.get::<Property>("rtcGetDeviceProperty")?,
                device_error: *library.get::<LastError>("rtcGetDeviceError")?,
                new_scene: *library.get::<NewScene>("rtcNewScene")?,
                release_scene: *library.get::<OfHandle>("rtcReleaseScene")?,
                set_scene_quality: *library.get::<SetOption>("rtcSetSceneBuildQuality")?,
                set_scene_flags: *library.get::<SetOption>("rtcSetSceneFlags")?,
                commit_scene: *library.get::<OfHandle>("rtcCommitScene")?,
                new_geometry: *library.get::<NewGeometry>("rtcNewGeometry")?,
                release_geometry: *library.get::<OfHandle>("rtcReleaseGeometry")?,
                set_geometry_quality: *library.get::<SetOption>("rtcSetGeometryBuildQuality")?,
                commit_geometry: *library.get::<OfHandle>("rtcCommitGeometry")?,
                new_buffer: *library.get::<NewBuffer>("rtcSetNewGeometryBuffer")?,
                attach: *library.get::<Attach>("rtcAttachGeometry")?,
                intersect: [
                    *library.get::<Query>("rtcIntersect4")?,
                    *library.get::<Query>("rtcIntersect8")?,
                    *library.get::<Query>("rtcIntersect16")?,
                ],
                occluded: [
                    *library.get::<Query>("rtcOccluded4")?,
                    *library.get::<Query>("rtcOccluded8")?,
                    *library.get::<Query>("rtcOccluded16")?,
                ],
            })
        }
    }
}

/// A scene of one mesh.
pub(super) struct Scene {
    embree: Arc<Embree>,
    device: NonNull<c_void>,
    scene: NonNull<c_void>,
}

// SAFETY: the interface allows queries of a committed scene from any number of threads, and a `Scene` is committed
// before it is shared: `commit` takes it by unique reference, and nothing else changes it.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

impl Scene {
    /// Copies the triangles into a new scene that is not committed yet. `quality` is 0, 1 or 2.
    ///
    /// # Panics
    /// If an index is out of range.
    pub(super) fn new(
        embree: &Arc<Embree>,
        threads: usize,
        (quality, robust): (c_int, bool),
        vertices: &[[f32; 3]],
        indices: &[[u32; 3]],
    ) -> Result<Self, String> {
        assert!(indices.iter().flatten().all(|&i| (i as usize) < vertices.len()));
        let functions = &embree.functions;
        let device = embree.device(threads)?;
        // SAFETY: `device` is live; a null scene is an error and not used.
        let Some(scene) = NonNull::new(unsafe { (functions.new_scene)(device.as_ptr()) }) else {
            // SAFETY: nobody else has this device.
            unsafe { (functions.release_device)(device.as_ptr()) };
            return Err("no scene".into());
        };
        // From here on dropping releases both.
        let this = Self {
            embree: Arc::clone(embree),
            device,
            scene,
        };
        // SAFETY: handles are live. The buffers belong to the geometry and hold what was asked for, items of 12
        // bytes; they are written within their length before anything reads them. The scene keeps the geometry.
        unsafe {
            (functions.set_scene_quality)(scene.as_ptr(), quality);
            (functions.set_scene_flags)(scene.as_ptr(), if robust { ROBUST } else { 0 });
            let geometry = (functions.new_geometry)(device.as_ptr(), TRIANGLE);
            if geometry.is_null() {
                return Err("no geometry".into());
            }
            (functions.set_geometry_quality)(geometry, quality);
            let filled = fill(functions, geometry, VERTEX_BUFFER, FLOAT3, vertices)
                && fill(functions, geometry, INDEX_BUFFER, UINT3, indices);
            if filled {
                (functions.commit_geometry)(geometry);
                (functions.attach)(scene.as_ptr(), geometry);
            }
            (functions.release_geometry)(geometry);
            if !filled {
                return Err("no buffer".into());
            }
        }
        embree.check(device, "making a scene")?;
        Ok(this)
    }

    /// Builds its structure.
    pub(super) fn commit(&mut self) -> Result<(), String> {
        // SAFETY: the scene is live and nobody else uses it.
        unsafe { (self.embree.functions.commit_scene)(self.scene.as_ptr()) };
        self.embree.check(self.device, "building")
    }

    /// Rays of a packet that is native here.
    #[inline]
    pub(super) fn width(&self) -> usize {
        self.embree.width
    }

    /// Closest hits of coherent rays.
    #[inline]
    pub(super) fn closest<const N: usize>(&self, valid: &Valid<N>, packet: &mut Packet<N>) {
        let query = self.embree.functions.intersect[const { of_width::<N>() }];
        self.query(query, valid.0.as_ptr(), (&raw mut *packet).cast());
    }

    /// Any hits of coherent rays.
    #[inline]
    pub(super) fn occluded<const N: usize>(&self, valid: &Valid<N>, rays: &mut Rays<N>) {
        let query = self.embree.functions.occluded[const { of_width::<N>() }];
        self.query(query, valid.0.as_ptr(), (&raw mut *rays).cast());
    }

    /// `valid` and `packet` are what `query` takes: as many lanes as its width, in [`Packet`] or [`Rays`].
    #[inline]
    fn query(&self, query: Query, valid: *const c_int, packet: *mut c_void) {
        if self.embree.major == 3 {
            let mut context = Context3 {
                flags: COHERENT_3,
                filter: null(),
                instances: [c_uint::MAX; 16],
            };
            let context = (&raw mut context).cast();
            // SAFETY: the scene is live and committed; mask, context and packet have the layout and alignment of the
            // interface and outlive the call, which keeps none of them.
            unsafe { query(valid, self.scene.as_ptr(), context, packet) };
        } else {
            let mut arguments = Arguments4 {
                flags: COHERENT_4,
                features: c_uint::MAX,
                context: null(),
                filter: null(),
                callback: null(),
                spare: [0; 4],
            };
            let arguments = (&raw mut arguments).cast();
            // SAFETY: as above.
            unsafe { query(valid, self.scene.as_ptr(), packet, arguments) };
        }
    }
}

/// Place of the function for packets of this width.
const fn of_width<const N: usize>() -> usize {
    match N {
        4 => 0,
        8 => 1,
        16 => 2,
        _ => panic!("packets have 4, 8 or 16 rays"),
    }
}

/// Copies `items` into a new buffer of the geometry; says whether there is one.
///
/// # Safety
/// `geometry` is a live handle of the library of `functions`, and `format` describes an item.
unsafe fn fill<T: Copy>(
    functions: &Functions,
    geometry: Handle,
    buffer: c_int,
    format: c_int,
    items: &[[T; 3]],
) -> bool {
    let size = size_of::<[T; 3]>();
    // SAFETY: promised by the caller; the buffer has room for `items` and is not shared yet.
    unsafe {
        let target = (functions.new_buffer)(geometry, buffer, 0, format, size, items.len());
        if target.is_null() {
            return false;
        }
        std::ptr::copy_nonoverlapping(
            items.as_ptr().cast::<u8>(),
            target.cast::<u8>(),
            size_of_val(items),
        );
    }
    true
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: both are live and released once, the scene before its device.
        unsafe {
            (self.embree.functions.release_scene)(self.scene.as_ptr());
            (self.embree.functions.release_device)(self.device.as_ptr());
        }
    }
}
