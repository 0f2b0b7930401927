//! From a triangle, barycentrics and a view direction to everything the reflection model asks for.
//!
//! Normals: the geometric one is that of the triangle's plane, in f64; the shading normal is interpolated where
//! an object has normals and bent by the normal map. Both are turned towards the viewer, so that back faces are
//! shaded like front faces. Where an object has a normal map but no tangents, these follow from the triangle's
//! texture coordinates as in `MikkTSpace`, not smoothed over vertices.
//!
//! Textures are filtered by the footprint of the pixel on the surface (Akenine-Möller et al., "Texture Level of
//! Detail Strategies for Real-Time Ray Tracing", 2019: ray cones of one bounce). Masks are not filtered.

use glam::{DVec3, Vec2, Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;
use rayward_scene::{AlphaMode, FrameGeometry, Scene};
use rayward_trace::solids::Crossing;

use super::coat::Coat;
use super::finish::{self, SurfaceFinish};
use super::lobes::seen_normal;
use super::material::{ShaderCoat, ShaderMaterial, references};
use crate::texture::{Texture, Textures};

/// A point on a surface of the frame, as seen from somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Triangle id.
    pub prim: u32,
    /// Index of the object it belongs to, see [`object_of`].
    pub object: u32,
    /// Barycentric weight of corner 1.
    pub u: f32,
    /// Barycentric weight of corner 2.
    pub v: f32,
    /// Unit direction towards the viewer.
    pub view: Vec3,
    /// Width of the pixel at the point, perpendicular to the view, metres; 0 for unfiltered textures.
    pub footprint: f32,
}

/// The object that a triangle belongs to.
///
/// # Panics
/// If there is no such triangle.
#[inline]
pub fn object_of(geometry: &FrameGeometry, prim: u32) -> u32 {
    let object = geometry
        .objects
        .partition_point(|object| object.triangles.end <= prim);
    assert!(object < geometry.objects.len(), "no triangle {prim}");
    object as u32
}

/// A point on a surface with all that its reflection depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Position in the local frame of the geometry, metres.
    pub position: Vec3,
    /// Unit normal of the triangle, on the viewer's side.
    pub geometric_normal: Vec3,
    /// Unit normal for shading, on the viewer's side of the triangle unless a normal map bends it away.
    pub normal: Vec3,
    /// Unit direction towards the viewer.
    pub view: Vec3,
    /// Linear base colour: vertex colour, factor and texture.
    pub base_color: Vec3,
    /// Coverage after the material's alpha mode: 1 is solid, 0 absent.
    pub alpha: f32,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Reflectance of the dielectric at normal incidence.
    pub f0: Vec3,
    /// Weight of the dielectric's reflection.
    pub specular: f32,
    /// Share of light transmitted instead of diffused.
    pub transmission: f32,
    /// Index of refraction.
    pub ior: f32,
    /// Whether there is no volume behind: what is transmitted goes straight on.
    pub thin: bool,
    /// Absorption of the volume, per metre; zero for clear ones.
    pub absorption: Vec3,
    /// Emitted radiance.
    pub emissive: Vec3,
    /// Share of the surrounding light that reaches the point.
    pub occlusion: f32,
    /// Whether it shows its base colour without any lighting.
    pub unlit: bool,
    /// Whether the viewer is on the front side of the triangle.
    pub front: bool,
    /// Film, sheen and anisotropy.
    pub finish: SurfaceFinish,
    /// What lies over all of that.
    pub coat: Coat,
}

impl Surface {
    /// The index of refraction on the viewer's side over that behind.
    #[inline]
    pub fn relative_ior(&self) -> f32 {
        if self.front || self.thin {
            1.0 / self.ior
        } else {
            self.ior
        }
    }

    /// Absorption along a ray that this surface has transmitted: inside of its volume, or outside again.
    #[inline]
    pub fn enters_volume(&self) -> bool {
        self.front && !self.thin
    }
}

/// The materials and textures of a scene, prepared once for all of its frames.
#[derive(Clone, Debug)]
pub struct Shader<'s> {
    materials: Vec<ShaderMaterial>,
    textures: Textures<'s>,
}

/// Corners of a triangle and their weights at a point.
#[derive(Clone, Copy)]
struct Corners {
    vertices: [usize; 3],
    weights: [f32; 3],
}

impl Corners {
    #[inline]
    fn new(geometry: &FrameGeometry, prim: u32, u: f32, v: f32) -> Self {
        let vertices = geometry.indices[prim as usize].map(|i| i as usize);
        Self {
            vertices,
            weights: [1.0 - u - v, u, v],
        }
    }

    /// The corners' values of an attribute; `None` if no object has it.
    #[inline]
    fn values<T: Copy>(&self, attribute: &[T]) -> Option<[T; 3]> {
        (!attribute.is_empty()).then(|| self.vertices.map(|i| attribute[i]))
    }

    #[inline]
    fn mix<T>(&self, [a, b, c]: [T; 3]) -> T
    where
        T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        a * self.weights[0] + b * self.weights[1] + c * self.weights[2]
    }
}

/// The footprint's share with which masks are looked up: the mean of a mask is no mask, leaves would vanish at a distance, and
/// not be those that cast shadows.
const UNFILTERED: f32 = 0.0;

/// The plane of a triangle as it is seen at a point.
struct Plane {
    /// Corner 0.
    first: Vec3,
    edges: [Vec3; 2],
    /// Unit normal, or zero.
    outward: Vec3,
    front: bool,
    /// Area of the pixel's footprint over the doubled area of the triangle.
    share: f32,
}

impl Plane {
    #[inline]
    fn new(geometry: &FrameGeometry, point: &SurfacePoint) -> Self {
        let positions = geometry.indices[point.prim as usize].map(|i| geometry.position(i));
        let edges = [positions[1] - positions[0], positions[2] - positions[0]];
        let plane = edges[0].as_dvec3().cross(edges[1].as_dvec3());
        let outward = plane.normalize_or_zero().as_vec3();
        let cos = outward.dot(point.view);
        let pixel = point.footprint / cos.abs().max(1e-3);
        Self {
            first: positions[0],
            edges,
            outward,
            front: cos >= 0.0,
            share: pixel * pixel / plane.length() as f32,
        }
    }
}

/// Texture coordinates of a point in one set.
#[derive(Clone, Copy, Default)]
struct Coordinates {
    corners: [Vec2; 3],
    at: Vec2,
    /// Area of the pixel's footprint in texture coordinates.
    area: f32,
}

impl Coordinates {
    #[inline]
    fn new(corners: &Corners, attribute: &[Vec2], footprint_share: f32) -> Self {
        let Some(uvs) = corners.values(attribute) else {
            return Self::default();
        };
        let area = (uvs[1] - uvs[0]).perp_dot(uvs[2] - uvs[0]).abs();
        Self {
            corners: uvs,
            at: corners.mix(uvs),
            area: area * footprint_share,
        }
    }
}

/// Texture lookups at one point.
pub(super) struct Lookup<'a> {
    textures: &'a Textures<'a>,
    sets: [Coordinates; 2],
}

impl Lookup<'_> {
    #[inline]
    fn set(&self, texture: &Texture) -> &Coordinates {
        &self.sets[usize::from(texture.uv_set.min(1))]
    }

    /// A texture's coordinates of the corners, the first set's as they are without a texture.
    #[inline]
    fn corners(&self, texture: Option<&Texture>) -> [Vec2; 3] {
        match texture {
            Some(texture) => self.set(texture).corners.map(|uv| texture.transform(uv)),
            None => self.sets[0].corners,
        }
    }

    /// The texel, or `None` without a texture.
    #[inline]
    pub(super) fn get(&self, texture: &Option<Texture>) -> Option<Vec4> {
        let texture = texture.as_ref()?;
        let set = self.set(texture);
        Some(self.textures.sample(texture, set.at, texture.level_of(set.area)))
    }
}

impl<'s> Shader<'s> {
    /// Resolves all materials and builds the mip pyramids of the textures they use.
    pub fn new(scene: &'s Scene) -> Self {
        let uses: Vec<_> = scene
            .materials
            .iter()
            .flat_map(|material| {
                references(material)
                    .into_iter()
                    .chain(finish::references(material))
            })
            .filter_map(|(reference, encoding)| Some((reference?, encoding)))
            .collect();
        let textures = Textures::new(scene, &uses);
        let materials = scene
            .materials
            .par_iter()
            .map(|m| ShaderMaterial::new(m, scene, &textures))
            .collect();
        Self { materials, textures }
    }

    /// The materials of the scene, in its order.
    pub fn materials(&self) -> &[ShaderMaterial] {
        &self.materials
    }

    /// The images that these use.
    pub fn textures(&self) -> &Textures<'s> {
        &self.textures
    }

    /// Share of light that a surface lets through at a point: what the alpha of [`Self::surface`] leaves, for a
    /// fraction of its cost. Textures are not filtered.
    ///
    /// A thin wall passes light straight on in its colour, by what its reflection leaves head on.
    /// `tinted` light takes on the colour of blended surfaces as far as they cover: `(1 - a) (1 - a + a c)` for
    /// coverage `a` and base colour `c`.
    pub fn transmittance(
        &self,
        geometry: &FrameGeometry,
        prim: u32,
        object: u32,
        [u, v]: [f32; 2],
        tinted: bool,
    ) -> Vec3 {
        let material = self.material(geometry, object);
        if material.is_opaque() {
            return Vec3::ZERO;
        }
        let corners = Corners::new(geometry, prim, u, v);
        let lookup = self.lookup(geometry, &corners, material, 0.0);
        let base = base_color(geometry, &corners, material, &lookup);
        let covered = material.coverage(base.w);
        let left = Vec3::splat(1.0 - covered);
        let color = base.xyz().clamp(Vec3::ZERO, Vec3::ONE);
        let past = if tinted && material.alpha_mode == AlphaMode::Blend {
            left * (left + color * covered)
        } else {
            left
        };
        past + color * (covered * material.passed(&lookup))
    }

    /// Whether an object's material lets no light through straight.
    pub fn is_opaque(&self, geometry: &FrameGeometry, object: u32) -> bool {
        self.material(geometry, object).is_opaque()
    }

    /// The surface at a point.
    ///
    /// # Panics
    /// If there is no such triangle or object, or the geometry is not of the shader's scene.
    pub fn surface(&self, geometry: &FrameGeometry, point: &SurfacePoint) -> Surface {
        let material = self.material(geometry, point.object);
        let corners = Corners::new(geometry, point.prim, point.u, point.v);
        let Plane {
            first,
            edges,
            outward,
            front,
            share,
        } = Plane::new(geometry, point);
        let geometric_normal = if front { outward } else { -outward };
        let lookup = self.lookup(geometry, &corners, material, share);
        let base = base_color(geometry, &corners, material, &lookup);
        let arm = lookup
            .get(&material.metallic_roughness_texture)
            .unwrap_or(Vec4::ONE);
        let occlusion = lookup
            .get(&material.occlusion_texture)
            .map_or(1.0, |texel| texel.x);
        let emission = lookup.get(&material.emissive_texture).unwrap_or(Vec4::ONE).xyz();
        let specular = lookup
            .get(&material.specular_texture)
            .map_or(1.0, |texel| texel.w);
        let specular_color = lookup
            .get(&material.specular_color_texture)
            .unwrap_or(Vec4::ONE)
            .xyz();
        let transmission = lookup
            .get(&material.transmission_texture)
            .map_or(1.0, |texel| texel.x);
        let normal = |map: (&Option<Texture>, f32)| {
            let sides = [outward, geometric_normal];
            shading_normal(geometry, &corners, map, &lookup, edges, sides)
        };
        let shading = normal((&material.normal_texture, material.normal_scale));
        let finish = material.finish.as_ref().map(|finish| {
            let cos = seen_normal([shading, geometric_normal], point.view).dot(point.view);
            let texel = |texture: &Option<Texture>| lookup.get(texture);
            finish.at(cos, texel, || {
                let texture = finish
                    .direction_texture
                    .as_ref()
                    .or(material.normal_texture.as_ref());
                tangent_frame(
                    geometry,
                    &corners,
                    texture,
                    &lookup,
                    edges,
                    if front { shading } else { -shading },
                )
            })
        });
        Surface {
            position: first + edges[0] * point.u + edges[1] * point.v,
            geometric_normal,
            normal: shading,
            view: point.view,
            base_color: base.xyz(),
            alpha: self.covered(geometry, &corners, material, base.w),
            metallic: (material.metallic * arm.z).clamp(0.0, 1.0),
            roughness: (material.roughness * arm.y).clamp(0.0, 1.0),
            f0: (material.ior_reflectance * material.specular_color * specular_color).min(Vec3::ONE),
            specular: material.specular * specular,
            transmission: material.transmission * transmission,
            ior: material.ior,
            thin: material.thin,
            absorption: material.absorption,
            emissive: material.emissive * emission,
            occlusion: 1.0 + material.occlusion_strength * (occlusion - 1.0),
            unlit: material.unlit,
            front,
            finish: finish.unwrap_or(SurfaceFinish::NONE),
            coat: coat(&material.coat, &lookup, [point.view, geometric_normal], normal),
        }
    }

    /// The alpha of [`Self::surface`] alone.
    pub fn coverage(&self, geometry: &FrameGeometry, point: &SurfacePoint) -> f32 {
        let material = self.material(geometry, point.object);
        let corners = Corners::new(geometry, point.prim, point.u, point.v);
        let share = match material.alpha_mode {
            AlphaMode::Mask { .. } => UNFILTERED,
            _ => Plane::new(geometry, point).share,
        };
        self.covered_by(geometry, &corners, material, share)
    }

    /// Coverage by texels filtered over this share of the triangle.
    #[inline]
    fn covered_by(
        &self,
        geometry: &FrameGeometry,
        corners: &Corners,
        material: &ShaderMaterial,
        share: f32,
    ) -> f32 {
        let lookup = self.lookup(geometry, corners, material, share);
        material.coverage(base_color(geometry, corners, material, &lookup).w)
    }

    /// The surface of a solid where a ray crosses it. A solid has a volume, whatever the thickness of its material, and no
    /// texture coordinates.
    pub(crate) fn solid_surface(
        &self,
        material: u32,
        position: DVec3,
        crossing: &Crossing,
        view: Vec3,
    ) -> Surface {
        let material = &self.materials[material as usize];
        let outward = crossing.normal.as_vec3();
        let normal = if crossing.enters { outward } else { -outward };
        let finish = material.finish.as_ref();
        let finish = finish.map(|finish| finish.at(normal.dot(view), |_| None, || None));
        Surface {
            position: position.as_vec3(),
            geometric_normal: normal,
            normal,
            view,
            base_color: material.base_color.xyz(),
            alpha: 1.0,
            metallic: material.metallic.clamp(0.0, 1.0),
            roughness: material.roughness.clamp(0.0, 1.0),
            f0: (material.ior_reflectance * material.specular_color).min(Vec3::ONE),
            specular: material.specular,
            transmission: material.transmission,
            ior: material.ior,
            thin: false,
            absorption: material.absorption,
            emissive: material.emissive,
            occlusion: 1.0,
            unlit: material.unlit,
            front: crossing.enters,
            finish: finish.unwrap_or(SurfaceFinish::NONE),
            coat: Coat::new(material.coat.factor, material.coat.roughness, [normal; 2], view),
        }
    }

    /// Coverage at a point where the filtered alpha is this.
    #[inline]
    fn covered(
        &self,
        geometry: &FrameGeometry,
        corners: &Corners,
        material: &ShaderMaterial,
        filtered: f32,
    ) -> f32 {
        let AlphaMode::Mask { .. } = material.alpha_mode else {
            return material.coverage(filtered);
        };
        self.covered_by(geometry, corners, material, UNFILTERED)
    }

    fn material(&self, geometry: &FrameGeometry, object: u32) -> &ShaderMaterial {
        &self.materials[geometry.objects[object as usize].material as usize]
    }

    /// `footprint_share`: area of the pixel's footprint over the doubled area of the triangle.
    #[inline]
    fn lookup(
        &self,
        geometry: &FrameGeometry,
        corners: &Corners,
        material: &ShaderMaterial,
        footprint_share: f32,
    ) -> Lookup<'_> {
        let attributes = &geometry.attributes;
        let sets = if material.textured {
            [&attributes.uvs, &attributes.uvs1].map(|uvs| Coordinates::new(corners, uvs, footprint_share))
        } else {
            [Coordinates::default(); 2]
        };
        Lookup {
            textures: &self.textures,
            sets,
        }
    }
}

/// Vertex colour, factor and texture.
#[inline]
fn base_color(
    geometry: &FrameGeometry,
    corners: &Corners,
    material: &ShaderMaterial,
    lookup: &Lookup,
) -> Vec4 {
    let vertex = corners
        .values(&geometry.attributes.colors)
        .map_or(Vec4::ONE, |colors| corners.mix(colors));
    material.base_color * vertex * lookup.get(&material.base_color_texture).unwrap_or(Vec4::ONE)
}

/// The coat at a point; `normal` bends the surface's normal by a map and its scale.
#[inline]
fn coat(
    coat: &ShaderCoat,
    lookup: &Lookup,
    [view, geometric]: [Vec3; 2],
    normal: impl Fn((&Option<Texture>, f32)) -> Vec3,
) -> Coat {
    if coat.factor == 0.0 {
        return Coat::NONE;
    }
    let factor = lookup.get(&coat.texture).map_or(1.0, |texel| texel.x);
    let roughness = lookup.get(&coat.roughness_texture).map_or(1.0, |texel| texel.y);
    Coat::new(
        coat.factor * factor,
        coat.roughness * roughness,
        [normal((&coat.normal_texture, coat.normal_scale)), geometric],
        view,
    )
}

/// The interpolated and bent normal, turned to the side of `facing`; `outward` where there are no normals.
#[inline]
fn shading_normal(
    geometry: &FrameGeometry,
    corners: &Corners,
    (map, scale): (&Option<Texture>, f32),
    lookup: &Lookup,
    edges: [Vec3; 2],
    [outward, facing]: [Vec3; 2],
) -> Vec3 {
    let smooth = corners
        .values(&geometry.attributes.normals)
        .filter(|normals| normals.iter().all(|&n| n != Vec3::ZERO))
        .and_then(|normals| corners.mix(normals).try_normalize());
    let normal = smooth.unwrap_or(outward);
    // The whole tangent frame is mirrored for a viewer on the other side.
    let side = if normal.dot(facing) < 0.0 { -1.0 } else { 1.0 };
    let Some(texture) = map else {
        return normal * side;
    };
    let Some(texel) = lookup.get(map) else {
        return normal * side;
    };
    let uvs = || lookup.corners(Some(texture));
    let Some((tangent, handedness)) = tangent(geometry, corners, uvs, edges, normal) else {
        return normal * side;
    };
    let bent = (texel.xyz() * 2.0 - Vec3::ONE) * Vec3::new(scale, scale, 1.0);
    let bitangent = normal.cross(tangent) * handedness;
    (tangent * bent.x + bitangent * bent.y + normal * bent.z).normalize_or(normal) * side
}

/// Tangent and bitangent about a normal, by a texture's coordinates where there are no tangents.
fn tangent_frame(
    geometry: &FrameGeometry,
    corners: &Corners,
    texture: Option<&Texture>,
    lookup: &Lookup,
    edges: [Vec3; 2],
    normal: Vec3,
) -> Option<[Vec3; 2]> {
    let (along, handedness) = tangent(geometry, corners, || lookup.corners(texture), edges, normal)?;
    Some([along, normal.cross(along) * handedness])
}

/// Unit tangent perpendicular to the normal, and the sign of the bitangent `normal x tangent`. glTF's texture
/// coordinates have v downwards and its normal maps green upwards, so an unmirrored map has the sign +1.
#[inline]
fn tangent(
    geometry: &FrameGeometry,
    corners: &Corners,
    uvs: impl FnOnce() -> [Vec2; 3],
    edges: [Vec3; 2],
    normal: Vec3,
) -> Option<(Vec3, f32)> {
    let given = corners
        .values(&geometry.attributes.tangents)
        .filter(|ts| ts.iter().all(|t| t.w != 0.0));
    let (along, handedness) = match given {
        Some(tangents) => (corners.mix(tangents).xyz(), tangents[0].w.signum()),
        None => {
            let uvs = uvs();
            let (d1, d2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
            // Scaled by the square of the determinant, which normalising removes; only its sign matters.
            let sign = d1.perp_dot(d2).signum();
            let along_u = (edges[0] * d2.y - edges[1] * d1.y) * sign;
            let along_v = (edges[1] * d1.x - edges[0] * d2.x) * sign;
            (along_u, -normal.cross(along_u).dot(along_v).signum())
        }
    };
    let tangent = (along - normal * normal.dot(along)).try_normalize()?;
    Some((tangent, handedness))
}
