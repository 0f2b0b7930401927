// Vertices posed by their joints: `crates/scene/src/pose/` in f32. Then in texel coordinates.

struct Skin {
    corner: vec3f,
    vertices: u32,
    per_side: f32,
}

// 32 bytes.
struct Influence {
    joints: vec4u,
    shares: vec4f,
}

@group(0) @binding(0) var<uniform> skin: Skin;
@group(0) @binding(1) var<storage, read> rest: array<f32>;
@group(0) @binding(2) var<storage, read> influences: array<Influence>;
// Three rows a joint.
@group(0) @binding(3) var<storage, read> joints: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> posed: array<f32>;
@group(0) @binding(5) var<storage, read_write> texels: array<f32>;

// Which vertex an invocation has; there may be more of them than vertices.
struct Invocation {
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
}

fn vertex(invocation: Invocation) -> u32 {
    return (invocation.group.y * invocation.groups.x + invocation.group.x) * 64u + invocation.local;
}

@compute @workgroup_size(64)
fn pose(invocation: Invocation) {
    let v = vertex(invocation);
    if v >= skin.vertices {
        return;
    }
    let influence = influences[v];
    var x = vec4f(0.0);
    var y = vec4f(0.0);
    var z = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let share = influence.shares[i];
        if share != 0.0 {
            let row = 3u * influence.joints[i];
            x += share * joints[row];
            y += share * joints[row + 1u];
            z += share * joints[row + 2u];
        }
    }
    let p = vec4f(rest[3u * v], rest[3u * v + 1u], rest[3u * v + 2u], 1.0);
    posed[3u * v] = dot(x, p);
    posed[3u * v + 1u] = dot(y, p);
    posed[3u * v + 2u] = dot(z, p);
}

@compute @workgroup_size(64)
fn to_texels(invocation: Invocation) {
    let v = vertex(invocation);
    if v >= skin.vertices {
        return;
    }
    for (var axis = 0u; axis < 3u; axis++) {
        texels[3u * v + axis] = (posed[3u * v + axis] - skin.corner[axis]) * skin.per_side;
    }
}
