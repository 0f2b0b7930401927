// Surfaces where rays meet triangles: `crates/render/src/shade/surface.rs` in f32. Planes of triangles come from there, in f64.

struct Shading {
    points: u32,
    // First floats of the attributes of all vertices, after their positions; NOTHING of what no vertex has.
    normals: u32,
    tangents: u32,
    colors: u32,
    uvs: u32,
    uvs1: u32,
    pad_a: u32,
    pad_b: u32,
    // Linear light of every byte of a colour.
    srgb: array<vec4f, 64>,
}

// 32 bytes.
struct Point {
    view: vec3f,
    footprint: f32,
    prim: u32,
    u: f32,
    v: f32,
    pad: u32,
}

// 32 bytes.
struct Triangle {
    normal: vec3f,
    // Length of the cross product of its edges.
    doubled_area: f32,
    corner_a: u32,
    corner_b: u32,
    corner_c: u32,
    material: u32,
}

const MASKED: u32 = 1u;
const BLENDED: u32 = 2u;

// 160 bytes.
struct Material {
    base_color: vec4f,
    emissive: vec3f,
    metallic: f32,
    specular_color: vec3f,
    roughness: f32,
    absorption: vec3f,
    ior_reflectance: f32,
    specular: f32,
    transmission: f32,
    ior: f32,
    normal_scale: f32,
    occlusion_strength: f32,
    alpha_mode: u32,
    cutoff: f32,
    flags: u32,
    coat_factor: f32,
    coat_roughness: f32,
    coat_normal_scale: f32,
    pad: u32,
    // Numbers of its uses of images, NOTHING where there is none.
    textures: array<u32, 12>,
}

@group(0) @binding(0) var<uniform> shading: Shading;
@group(0) @binding(1) var<storage, read> points: array<Point>;
@group(0) @binding(2) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(3) var<storage, read> vertices: array<f32>;
@group(0) @binding(7) var<storage, read> materials: array<Material>;
@group(0) @binding(8) var<storage, read_write> surfaces: array<Surface>;

// What all lookups at a point share.
struct Place {
    corners: vec3u,
    weights: vec3f,
    edge_b: vec3f,
    edge_c: vec3f,
    outward: vec3f,
    facing: vec3f,
    // Area of the pixel's footprint over the doubled area of the triangle.
    share: f32,
}

fn read2(first: u32, vertex: u32) -> vec2f {
    let at = first + 2u * vertex;
    return vec2f(vertices[at], vertices[at + 1u]);
}

fn read3(first: u32, vertex: u32) -> vec3f {
    let at = first + 3u * vertex;
    return vec3f(vertices[at], vertices[at + 1u], vertices[at + 2u]);
}

fn read4(first: u32, vertex: u32) -> vec4f {
    let at = first + 4u * vertex;
    return vec4f(vertices[at], vertices[at + 1u], vertices[at + 2u], vertices[at + 3u]);
}

// Texture coordinates of the corners in the set of a use; zero without such.
fn coordinates(place: Place, flags: u32) -> mat3x2f {
    let first = select(shading.uvs, shading.uvs1, (flags & SECOND_SET) != 0u);
    if first == NOTHING {
        return mat3x2f();
    }
    return mat3x2f(read2(first, place.corners.x), read2(first, place.corners.y), read2(first, place.corners.z));
}

// The texel of a use; ones without a texture.
fn look(number: u32, place: Place) -> vec4f {
    if number == NOTHING {
        return vec4f(1.0);
    }
    let image = uses[number];
    let uv = coordinates(place, image.flags);
    let b = uv[1] - uv[0];
    let c = uv[2] - uv[0];
    return sampled(image, uv * place.weights, abs(b.x * c.y - b.y * c.x) * place.share);
}

// A tangent that is not unit yet, and the sign of the bitangent.
fn tangent(image: Use, place: Place, normal: vec3f) -> vec4f {
    if shading.tangents != NOTHING {
        let a = read4(shading.tangents, place.corners.x);
        let b = read4(shading.tangents, place.corners.y);
        let c = read4(shading.tangents, place.corners.z);
        if a.w != 0.0 && b.w != 0.0 && c.w != 0.0 {
            let along = a.xyz * place.weights.x + b.xyz * place.weights.y + c.xyz * place.weights.z;
            return vec4f(along, select(-1.0, 1.0, a.w > 0.0));
        }
    }
    let corners = coordinates(place, image.flags);
    let a = transformed(image, corners[0]);
    let b = transformed(image, corners[1]) - a;
    let c = transformed(image, corners[2]) - a;
    let side = select(-1.0, 1.0, b.x * c.y - b.y * c.x >= 0.0);
    let along_u = (place.edge_b * c.y - place.edge_c * b.y) * side;
    let along_v = (place.edge_c * b.x - place.edge_b * c.x) * side;
    return vec4f(along_u, select(1.0, -1.0, dot(cross(normal, along_u), along_v) >= 0.0));
}

// The interpolated normal, bent by a map, on the side of the viewer.
fn shading_normal(number: u32, scale: f32, place: Place) -> vec3f {
    var normal = place.outward;
    if shading.normals != NOTHING {
        let a = read3(shading.normals, place.corners.x);
        let b = read3(shading.normals, place.corners.y);
        let c = read3(shading.normals, place.corners.z);
        if any(a != vec3f(0.0)) && any(b != vec3f(0.0)) && any(c != vec3f(0.0)) {
            let mixed = a * place.weights.x + b * place.weights.y + c * place.weights.z;
            normal = normalized_or(mixed, normal);
        }
    }
    let side = select(1.0, -1.0, dot(normal, place.facing) < 0.0);
    if number == NOTHING {
        return normal * side;
    }
    let image = uses[number];
    let found = tangent(image, place, normal);
    let along = normalized_or(found.xyz - normal * dot(normal, found.xyz), vec3f(0.0));
    if all(along == vec3f(0.0)) {
        return normal * side;
    }
    let bent = (look(number, place).xyz * 2.0 - 1.0) * vec3f(scale, scale, 1.0);
    let bitangent = cross(normal, along) * found.w;
    return normalized_or(along * bent.x + bitangent * bent.y + normal * bent.z, normal) * side;
}

fn covered(material: Material, alpha: f32) -> f32 {
    if material.alpha_mode == MASKED {
        return select(0.0, 1.0, alpha >= material.cutoff);
    }
    return select(1.0, clamp(alpha, 0.0, 1.0), material.alpha_mode == BLENDED);
}

fn place_of(point: Point, triangle: Triangle) -> Place {
    let corners = vec3u(triangle.corner_a, triangle.corner_b, triangle.corner_c);
    let a = read3(0u, corners.x);
    let cos = dot(triangle.normal, point.view);
    let pixel = point.footprint / max(abs(cos), 1e-3);
    return Place(
        corners,
        vec3f(1.0 - point.u - point.v, point.u, point.v),
        read3(0u, corners.y) - a,
        read3(0u, corners.z) - a,
        triangle.normal,
        select(-triangle.normal, triangle.normal, cos >= 0.0),
        pixel * pixel / triangle.doubled_area,
    );
}

fn surface_at(point: Point) -> Surface {
    let triangle = triangles[point.prim];
    let material = materials[triangle.material];
    let place = place_of(point, triangle);
    var base = material.base_color * look(material.textures[0], place);
    if shading.colors != NOTHING {
        let a = read4(shading.colors, place.corners.x);
        let b = read4(shading.colors, place.corners.y);
        let c = read4(shading.colors, place.corners.z);
        base *= a * place.weights.x + b * place.weights.y + c * place.weights.z;
    }
    let arm = look(material.textures[1], place);
    var surface: Surface;
    surface.position = read3(0u, place.corners.x) + place.edge_b * point.u + place.edge_c * point.v;
    surface.geometric_normal = place.facing;
    surface.normal = shading_normal(material.textures[2], material.normal_scale, place);
    surface.view = point.view;
    surface.base_color = base.xyz;
    surface.alpha = covered(material, base.w);
    surface.metallic = clamp(material.metallic * arm.z, 0.0, 1.0);
    surface.roughness = clamp(material.roughness * arm.y, 0.0, 1.0);
    let reflected = material.ior_reflectance * material.specular_color;
    surface.f0 = min(reflected * look(material.textures[6], place).xyz, vec3f(1.0));
    surface.specular = material.specular * look(material.textures[5], place).w;
    surface.transmission = material.transmission * look(material.textures[7], place).x;
    surface.ior = material.ior;
    surface.absorption = material.absorption;
    surface.emissive = material.emissive * look(material.textures[4], place).xyz;
    surface.occlusion = 1.0 + material.occlusion_strength * (look(material.textures[3], place).x - 1.0);
    surface.flags = material.flags | select(0u, FRONT, dot(place.outward, point.view) >= 0.0);
    surface.coat_normal = vec3f(0.0, 0.0, 1.0);
    surface.coat_passed = 1.0;
    if material.coat_factor != 0.0 {
        surface.coat_normal = shading_normal(material.textures[10], material.coat_normal_scale, place);
        let cos = dot(seen_normal(surface.coat_normal, place.facing, point.view), point.view);
        let factor = material.coat_factor * look(material.textures[8], place).x;
        surface.coat_reflectance = factor * (0.04 + 0.96 * schlick(cos));
        surface.coat_passed = 1.0 - surface.coat_reflectance;
        surface.coat_roughness = material.coat_roughness * look(material.textures[9], place).y;
    }
    return surface;
}

@compute @workgroup_size(64)
fn surface(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
           @builtin(local_invocation_index) local: u32) {
    let at = (group.y * groups.x + group.x) * 64u + local;
    if at < shading.points {
        surfaces[at] = surface_at(points[at]);
    }
}
