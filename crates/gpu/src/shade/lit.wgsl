// What surfaces send to their viewers of the light of their beams: `crates/render/src/shade/batch.rs`.

struct Lit {
    surfaces: u32,
    pad_a: u32,
    pad_b: u32,
    pad_c: u32,
}

const DIRECTIONAL: u32 = 0u;
const SPOT: u32 = 2u;
const COSINE: u32 = 3u;

// 64 bytes.
struct Lamp {
    position: vec3f,
    kind: u32,
    direction: vec3f,
    inverse_range2: f32,
    power: vec3f,
    radius: f32,
    scale: f32,
    offset: f32,
    pad_a: u32,
    pad_b: u32,
}

const AROUND: u32 = 0u;
const LIGHT: u32 = 1u;
// At a place and in a direction.
const SAMPLE_AT: u32 = 2u;
const SAMPLE_TOWARDS: u32 = 3u;
const DIRECTION: u32 = 4u;
// Lobes that are traced, of what is around.
const REFLECTION: u32 = 1u;
const TRANSMISSION: u32 = 2u;
const DIFFUSION: u32 = 4u;
const COAT: u32 = 8u;

// 64 bytes.
struct Beam {
    // Place, or direction.
    end: vec3f,
    kind: u32,
    share: vec3f,
    // Index of the light, or lobes that are traced.
    which: u32,
    radiance: vec3f,
    density: f32,
    // Rays drawn of the reflection, the coat's, and of diffuse light.
    drawn_own: u32,
    drawn_coat: u32,
    drawn_diffuse: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> lit: Lit;
@group(0) @binding(1) var<storage, read> surfaces: array<Surface>;
@group(0) @binding(2) var<storage, read> lamps: array<Lamp>;
@group(0) @binding(3) var<storage, read> beams: array<Beam>;
// Where the beams of each surface begin, and where the last end.
@group(0) @binding(4) var<storage, read> firsts: array<u32>;
@group(0) @binding(5) var<storage, read_write> sums: array<vec4f>;

// What arrives at a point; no radiance where nothing does.
struct Incident {
    towards: vec3f,
    radiance: vec3f,
}

fn incident_at(lamp: Lamp, position: vec3f, point: vec3f) -> Incident {
    let offset = position - point;
    let distance2 = dot(offset, offset);
    if distance2 == 0.0 {
        return Incident(vec3f(0.0), vec3f(0.0));
    }
    let towards = offset / sqrt(distance2);
    let cos = -dot(towards, lamp.direction);
    var angular = 1.0;
    if lamp.kind == SPOT {
        let falloff = clamp(cos * lamp.scale + lamp.offset, 0.0, 1.0);
        angular = falloff * falloff;
    } else if lamp.kind == COSINE {
        angular = max(cos, 0.0);
    }
    let reach = distance2 * lamp.inverse_range2;
    let window = max(1.0 - reach * reach, 0.0);
    return Incident(towards, lamp.power * (angular * window / distance2));
}

fn incident(lamp: Lamp, point: vec3f) -> Incident {
    if lamp.kind == DIRECTIONAL {
        return Incident(-lamp.direction, lamp.power);
    }
    return incident_at(lamp, lamp.position, point);
}

fn incident_from(lamp: Lamp, beam: Beam, point: vec3f) -> Incident {
    if beam.kind == SAMPLE_TOWARDS {
        let towards = normalized_or(beam.end, vec3f(0.0));
        return Incident(towards, select(lamp.power, vec3f(0.0), all(towards == vec3f(0.0))));
    }
    var found = incident_at(lamp, beam.end, point);
    if lamp.radius > 0.0 {
        // A sphere shows the disk that its outline spans; from inside, it is a point.
        let from_middle = point - lamp.position;
        let distance2 = dot(from_middle, from_middle);
        let radius2 = lamp.radius * lamp.radius;
        if distance2 > radius2 {
            let axis = normalized_or(from_middle, vec3f(0.0));
            found.radiance *= max(1.0 - radius2 / distance2, 0.0) * -dot(found.towards, axis);
        }
    }
    return found;
}

// Light of the surface's own and its coat's highlights by these shares.
fn reflected(surface: Surface, arrives: Incident, own: f32, of_coat: f32) -> vec3f {
    let towards = arrives.towards;
    let cos = dot(surface.normal, towards);
    let coated = surface.coat_reflectance > 0.0;
    let coat_cos = select(0.0, dot(surface.coat_normal, towards), coated);
    if !(cos > 0.0 || coat_cos > 0.0) || dot(surface.geometric_normal, towards) <= 0.0 {
        return vec3f(0.0);
    }
    var sent = (diffuse(surface, towards) + specular(surface, towards) * own) * max(cos, 0.0);
    if coated {
        sent += specular(coat_of(surface), towards) * (max(coat_cos, 0.0) * of_coat);
    }
    return arrives.radiance * sent;
}

// Share of a light's samples in a highlight that rays see, too (Veach and Guibas 1995).
fn sample_share(mirror: Surface, towards: vec3f, density: f32, drawn: u32) -> f32 {
    if drawn == 0u {
        return 1.0;
    }
    if mirror.roughness < SMOOTH {
        return 0.0;
    }
    if density <= 0.0 {
        return 1.0;
    }
    return density / (density + f32(drawn) * reflection_density(mirror, towards));
}

fn of_sample(surface: Surface, beam: Beam) -> vec3f {
    let arrives = incident_from(lamps[beam.which], beam, surface.position);
    let own = sample_share(surface, arrives.towards, beam.density, beam.drawn_own);
    var of_coat = 1.0;
    if surface.coat_reflectance > 0.0 {
        of_coat = sample_share(coat_of(surface), arrives.towards, beam.density, beam.drawn_coat);
    }
    return reflected(surface, arrives, own, of_coat);
}

// One layer's lobes in light from a drawn direction, over its density.
fn lobes_lit(surface: Surface, beam: Beam, drawn_own: u32, drawn_diffuse: u32) -> vec3f {
    let cos = dot(surface.normal, beam.end);
    if cos <= 0.0 {
        return vec3f(0.0);
    }
    let drawn = beam.density;
    var diffused = 0.0;
    if drawn_diffuse > 0u {
        diffused = f32(drawn_diffuse) * diffusion_density(surface, beam.end);
    }
    var sent = diffuse(surface, beam.end) * (drawn / (drawn + diffused));
    if surface.roughness >= SMOOTH {
        var mirrored = 0.0;
        if drawn_own > 0u {
            mirrored = f32(drawn_own) * reflection_density(surface, beam.end);
        }
        sent += specular(surface, beam.end) * (drawn / (drawn + mirrored));
    }
    return sent * (cos / drawn);
}

fn of_direction(surface: Surface, beam: Beam) -> vec3f {
    var sent = lobes_lit(surface, beam, beam.drawn_own, beam.drawn_diffuse);
    if surface.coat_reflectance > 0.0 {
        sent += lobes_lit(coat_of(surface), beam, beam.drawn_coat, 0u);
    }
    return sent * beam.radiance;
}

// Emission, and the surrounding as far as no lobe sees what is really there.
fn of_around(surface: Surface, beam: Beam) -> vec3f {
    if (surface.flags & UNLIT) != 0u {
        return surface.base_color;
    }
    let traced = beam.which;
    let dielectric = 1.0 - surface.metallic;
    var left = 1.0;
    if (traced & (REFLECTION | TRANSMISSION | DIFFUSION)) != 0u {
        left = select(surface.metallic, 0.0, (traced & REFLECTION) != 0u)
            + select(dielectric * surface.transmission, 0.0, (traced & TRANSMISSION) != 0u)
            + select(dielectric * (1.0 - surface.transmission), 0.0, (traced & DIFFUSION) != 0u);
    }
    let coat = select(surface.coat_reflectance, 0.0, (traced & COAT) != 0u);
    let around = beam.radiance * surface.base_color * (surface.occlusion * left);
    return (surface.emissive + around) * surface.coat_passed + beam.radiance * (coat * surface.occlusion);
}

fn sent(surface: Surface, beam: Beam) -> vec3f {
    if beam.kind == AROUND {
        return of_around(surface, beam);
    }
    if beam.kind == DIRECTION {
        return of_direction(surface, beam);
    }
    if (surface.flags & UNLIT) != 0u {
        return vec3f(0.0);
    }
    if beam.kind == LIGHT {
        return reflected(surface, incident(lamps[beam.which], surface.position), 1.0, 1.0);
    }
    return of_sample(surface, beam);
}

@compute @workgroup_size(64)
fn light(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
         @builtin(local_invocation_index) local: u32) {
    let at = (group.y * groups.x + group.x) * 64u + local;
    if at >= lit.surfaces {
        return;
    }
    let surface = surfaces[at];
    var sum = vec3f(0.0);
    for (var i = firsts[at]; i < firsts[at + 1u]; i++) {
        sum += sent(surface, beams[i]) * beams[i].share;
    }
    sums[at] = vec4f(sum, 0.0);
}
