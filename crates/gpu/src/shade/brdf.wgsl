// The reflection model: `crates/render/src/shade/brdf.rs`, `coat.rs` and densities of `lobes.rs`, in f32 as there.

const PI: f32 = 3.14159265;
// Roughness below which a surface is a mirror, and the smallest width of its distribution.
const SMOOTH: f32 = 0.0316;
const MIN_ALPHA: f32 = 1e-3;

fn largest(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn alpha_of(surface: Surface) -> f32 {
    return max(surface.roughness * surface.roughness, MIN_ALPHA);
}

// Fresnel's reflectance, scaled to rise from 0 to 1; below 0 at total reflection.
fn exact_rise(surface: Surface, cos: f32) -> f32 {
    let outside = (surface.flags & (FRONT | THIN)) != 0u;
    let ratio = select(surface.ior, 1.0 / surface.ior, outside);
    let behind2 = 1.0 - ratio * ratio * max(1.0 - cos * cos, 0.0);
    if behind2 <= 0.0 {
        return -1.0;
    }
    let behind = sqrt(behind2);
    let across = (ratio * cos - behind) / (ratio * cos + behind);
    let along = (cos - ratio * behind) / (cos + ratio * behind);
    let head_on = (surface.ior - 1.0) / (surface.ior + 1.0);
    let least = head_on * head_on;
    return clamp((0.5 * (across * across + along * along) - least) / (1.0 - least), 0.0, 1.0);
}

fn dielectric_reflectance(surface: Surface, cos: f32) -> vec3f {
    var rise = schlick(cos);
    if surface.transmission > 0.0 {
        rise = exact_rise(surface, abs(cos));
        if rise < 0.0 {
            return vec3f(1.0);
        }
    }
    return surface.specular * (surface.f0 + (1.0 - surface.f0) * rise);
}

fn reflectance(surface: Surface, cos: f32) -> vec3f {
    let metal = surface.base_color + (1.0 - surface.base_color) * schlick(cos);
    return mix(dielectric_reflectance(surface, cos), metal, surface.metallic) * surface.coat_passed;
}

fn distribution(normal: vec3f, half_way: vec3f, alpha: f32) -> f32 {
    let cos = dot(normal, half_way);
    if cos <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    let sin = cross(normal, half_way);
    let spread = a2 * cos * cos + dot(sin, sin);
    return a2 / (PI * spread * spread);
}

fn slope(cos: f32, a2: f32) -> f32 {
    return sqrt(cos * cos * (1.0 - a2) + a2);
}

fn diffuse(surface: Surface, towards: vec3f) -> vec3f {
    let half_way = normalized_or(towards + surface.view, surface.normal);
    let reflected = largest(dielectric_reflectance(surface, dot(surface.view, half_way)));
    let share = (1.0 - surface.metallic) * (1.0 - surface.transmission) / PI;
    return surface.base_color * (max(1.0 - reflected, 0.0) * share * surface.coat_passed);
}

fn specular(surface: Surface, towards: vec3f) -> vec3f {
    let half_way = normalized_or(towards + surface.view, surface.normal);
    let cos_light = max(dot(surface.normal, towards), 0.0);
    let cos_view = max(dot(surface.normal, surface.view), 1e-4);
    let alpha = alpha_of(surface);
    let a2 = alpha * alpha;
    let visible = 0.5 / (cos_light * slope(cos_view, a2) + cos_view * slope(cos_light, a2));
    let lobe = distribution(surface.normal, half_way, alpha) * visible;
    return reflectance(surface, dot(surface.view, half_way)) * lobe;
}

// The coat alone, as a white mirror.
fn coat_of(surface: Surface) -> Surface {
    var coat = surface;
    coat.normal = surface.coat_normal;
    coat.base_color = vec3f(0.0);
    coat.metallic = 0.0;
    coat.roughness = surface.coat_roughness;
    coat.f0 = vec3f(1.0);
    coat.specular = surface.coat_reflectance;
    coat.transmission = 0.0;
    coat.coat_reflectance = 0.0;
    coat.coat_passed = 1.0;
    return coat;
}

// Densities per steradian with which rays are drawn.
fn reflection_density(surface: Surface, towards: vec3f) -> f32 {
    let normal = seen_normal(surface.normal, surface.geometric_normal, surface.view);
    let cos_view = dot(normal, surface.view);
    if surface.roughness < SMOOTH || dot(normal, towards) <= 0.0 {
        return 0.0;
    }
    let alpha = alpha_of(surface);
    let half_way = normalized_or(towards + surface.view, normal);
    let seen = 2.0 * cos_view / (cos_view + slope(cos_view, alpha * alpha));
    return distribution(normal, half_way, alpha) * seen / (4.0 * cos_view);
}

fn diffusion_density(surface: Surface, towards: vec3f) -> f32 {
    return max(dot(surface.normal, towards), 0.0) / PI;
}
