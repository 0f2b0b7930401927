// A surface: `crates/render/src/shade/surface.rs`, and its coat.

const UNLIT: u32 = 1u;
const THIN: u32 = 2u;
const FRONT: u32 = 4u;

// 160 bytes.
struct Surface {
    position: vec3f,
    flags: u32,
    geometric_normal: vec3f,
    alpha: f32,
    normal: vec3f,
    metallic: f32,
    view: vec3f,
    roughness: f32,
    base_color: vec3f,
    specular: f32,
    f0: vec3f,
    transmission: f32,
    emissive: vec3f,
    ior: f32,
    absorption: vec3f,
    occlusion: f32,
    coat_normal: vec3f,
    coat_reflectance: f32,
    coat_passed: f32,
    coat_roughness: f32,
    pad_a: u32,
    pad_b: u32,
}

// A unit vector; the other where there is no direction.
fn normalized_or(v: vec3f, other: vec3f) -> vec3f {
    let length2 = dot(v, v);
    let found = length2 > 0.0 && length2 < 3e38;
    return select(other, v / sqrt(select(1.0, length2, found)), found);
}

fn schlick(cos: f32) -> f32 {
    let grazing = max(1.0 - abs(cos), 0.0);
    return grazing * grazing * (grazing * grazing) * grazing;
}

// The first of two normals, bent towards the viewer where it is turned away.
fn seen_normal(normal: vec3f, geometric: vec3f, view: vec3f) -> vec3f {
    let cos = dot(normal, view);
    if cos >= 0.01 {
        return normal;
    }
    return normalized_or(normal + view * (0.01 - cos), geometric);
}
