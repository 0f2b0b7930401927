// Closest and any hits through a hierarchy of boxes: `trace/src/bvh/` in f32, in the cube's texel coordinates.
//
// Boxes are grown by REACH on the host. That is more than an origin's rounding (2^-13 of a texel), a direction's over
// the way through the cube (2^-12) and that of a slab's distance, taken as a place, together; so no box that holds a
// hit is passed over, and none whose entry lies beyond a hit's upper bound holds a nearer one.

// 128 bytes: four boxes side by side.
struct Node {
    low_x: vec4f,
    high_x: vec4f,
    low_y: vec4f,
    high_y: vec4f,
    low_z: vec4f,
    high_z: vec4f,
    // A node, or where the child's triangles begin.
    first: vec4u,
    // Triangles of the child; NONE for a node.
    count: vec4u,
}

@group(0) @binding(3) var<storage, read> nodes: array<Node>;
// Triangles in the order of the leaves.
@group(0) @binding(4) var<storage, read> leaves: array<u32>;

// Children that can ever wait at a time; the host has counted them.
const STACK: u32 = 96u;

// Where a ray enters and leaves four boxes along one axis.
struct Slabs {
    enter: vec4f,
    leave: vec4f,
}

fn slabs(low: vec4f, high: vec4f, origin: f32, inverse: f32) -> Slabs {
    let a = (low - origin) * inverse;
    let b = (high - origin) * inverse;
    return Slabs(min(a, b), max(a, b));
}

fn answer(index: u32, ray: Ray) -> Found {
    let tiny = select(vec3f(1e-20), vec3f(-1e-20), ray.dir < vec3f(0.0));
    let inverse = 1.0 / select(ray.dir, tiny, abs(ray.dir) < vec3f(1e-20));
    var best = Best(Verdict(MISS, FAR, FAR), NONE, FAR);
    var opened = 0u;
    var tests = 0u;
    var t_end = ray.end;
    // First, count, bits of the distance of entry.
    var stack: array<vec3u, STACK>;
    stack[0] = vec3u(0u, NONE, bitcast<u32>(0.0));
    // A ray that ends before it starts misses the cube.
    var held = select(0u, 1u, t_end >= 0.0);
    while held > 0u && !settled(best) {
        held -= 1u;
        let entry = stack[held];
        if bitcast<f32>(entry.z) > t_end {
            continue;
        }
        if entry.y != NONE {
            for (var i = entry.x; i < entry.x + entry.y; i++) {
                let prim = leaves[i];
                if prim == ray.skip {
                    continue;
                }
                tests += 1u;
                // From where the box is entered on numbers are small.
                if improve(&best, meet(ray, prim, max(bitcast<f32>(entry.z), 0.0)), prim) {
                    t_end = min(t_end, best.verdict.high);
                }
            }
            continue;
        }
        opened += 1u;
        let node = nodes[entry.x];
        let x = slabs(node.low_x, node.high_x, ray.origin.x, inverse.x);
        let y = slabs(node.low_y, node.high_y, ray.origin.y, inverse.y);
        let z = slabs(node.low_z, node.high_z, ray.origin.z, inverse.z);
        let near = max(max(x.enter, y.enter), max(z.enter, vec4f(0.0)));
        let far = min(min(x.leave, y.leave), min(z.leave, vec4f(t_end)));
        let bottom = held;
        for (var lane = 0u; lane < 4u; lane++) {
            // A child that is missing has an inverted box.
            if near[lane] > far[lane] || node.count[lane] == 0u {
                continue;
            }
            // Insertion: the nearest child ends up on top.
            var at = held;
            while at > bottom && bitcast<f32>(stack[at - 1u].z) < near[lane] {
                stack[at] = stack[at - 1u];
                at -= 1u;
            }
            stack[at] = vec3u(node.first[lane], node.count[lane], bitcast<u32>(near[lane]));
            held += 1u;
        }
    }
    return told(best, vec3u(opened, 0u, 0u), tests);
}
