// Hits of triangles, or the word that f32 cannot tell.
//
// With u = 2^-24 and a cube of S texels, corners and the ray's point are known to 5 u S in texel coordinates. Relative
// to that point the edge functions are `d . (a x b)` with |d| <= 1 in each component and |a|, |b| <= A, so they are
// known to 12 A (5 u S + u A) for the positions, 6 u A^2 for the direction and 42 u A^2 for the sums: within
// 64 u A (S + A). A hit's parameter follows from them as weights of the corners' parameters. The definition of the
// answer, `trace::exact`, has its own error of 2^-22 of the parameter from the ray's true origin.

@group(0) @binding(1) var<storage, read> positions: array<f32>;
@group(0) @binding(2) var<storage, read> indices: array<u32>;

// A sample whose plane stays farther than this from the ray within its texel is not crossed: 1/127 for its slopes,
// the plane's own error, and the errors of coverage and walk.
const PLANE_SLACK: f32 = 0.0625;

fn corner_of(prim: u32, i: u32) -> vec3f {
    let at = 3u * indices[3u * prim + i];
    return vec3f(positions[at], positions[at + 1u], positions[at + 2u]);
}

// What is known of a ray and a triangle: MISS, HIT or UNSURE, and bounds of the parameter unless it is missed.
struct Verdict {
    state: u32,
    low: f32,
    high: f32,
}

fn meet(ray: Ray, prim: u32, t: f32) -> Verdict {
    let p = ray.origin + t * ray.dir;
    let a = corner_of(prim, 0u) - p;
    let b = corner_of(prim, 1u) - p;
    let c = corner_of(prim, 2u) - p;
    let m = max(max(abs(a), abs(b)), abs(c));
    let reach = max(max(m.x, m.y), m.z);
    let size = f32(max(max(frame.size.x, frame.size.y), frame.size.z)) + reach;
    let error = 64.0 * ULP * reach * size + 1e-30;
    let e = vec3f(dot(ray.dir, cross(b, c)), dot(ray.dir, cross(c, a)), dot(ray.dir, cross(a, b)));
    let low = min(min(e.x, e.y), e.z);
    let high = max(max(e.x, e.y), e.z);
    if low < -error && high > error {
        return Verdict(MISS, 0.0, 0.0);
    }
    let q = vec3f(dot(ray.dir, a), dot(ray.dir, b), dot(ray.dir, c)) / dot(ray.dir, ray.dir);
    let q_low = min(min(q.x, q.y), q.z);
    let q_high = max(max(q.x, q.y), q.z);
    let slack = 32.0 * ULP * size + 5.0 * ULP * (ray.before + t + reach);
    let sum = abs(e.x + e.y + e.z);
    if (low <= error && high >= -error) || sum <= 6.0 * error {
        return within(ray, UNSURE, vec2f(t + q_low, t + q_high), slack);
    }
    let at = t + dot(e, q) / (e.x + e.y + e.z);
    let spread = (q_high - q_low) * 3.0 * error / (sum - 3.0 * error);
    return within(ray, HIT, vec2f(at - spread, at + spread), slack);
}

// The same, as far as the ray's range lets it count.
fn within(ray: Ray, state: u32, bounds: vec2f, slack: f32) -> Verdict {
    let low = bounds.x - slack;
    let high = bounds.y + slack;
    let early = 2.0 * ULP * abs(ray.t_min);
    let late = 2.0 * ULP * abs(ray.t_max);
    if high < ray.t_min - early || low > ray.t_max + late {
        return Verdict(MISS, 0.0, 0.0);
    }
    let inside = low > ray.t_min + early && high < ray.t_max - late;
    return Verdict(select(UNSURE, state, inside), low, high);
}

// The triangles tested last, so that one over several texels is not tested in each.
fn seen(mailbox: ptr<function, vec4u>, prim: u32) -> bool {
    if any(*mailbox == vec4u(prim)) {
        return true;
    }
    *mailbox = vec4u(prim, (*mailbox).xyz);
    return false;
}

@compute @workgroup_size(64)
fn trace_exact(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
               @builtin(local_invocation_index) local: u32) {
    let index = thread_index(group, groups, local, 64u);
    if index >= query.rays {
        return;
    }
    let ray = rays[index];
    let order = axis_order(ray.dir);
    // The certain hit with the least upper bound, and the least lower bound of all others.
    var best = Verdict(MISS, FAR, FAR);
    var prim = NONE;
    var rival = FAR;
    var mailbox = vec4u(NONE);
    var steps = vec3u(0u);
    var tests = 0u;
    var t_end = ray.end;
    for (var i = 0u; i < 3u; i++) {
        var w = walk_start(ray, order[i], steps);
        while walk_next(&w, t_end, REACH) {
            for (var s = w.first; s < w.last; s++) {
                let id = samples[SAMPLE * s];
                let slopes = samples[SAMPLE * s + 2u];
                let off = above(w, bitcast<f32>(samples[SAMPLE * s + 1u]), slopes_of(slopes));
                let passes = min(off.x, off.y) > PLANE_SLACK || max(off.x, off.y) < -PLANE_SLACK;
                if id == ray.skip || id == prim || (passes && slopes != NO_PLANE) || seen(&mailbox, id) {
                    continue;
                }
                tests += 1u;
                let verdict = meet(ray, id, w.ends.x);
                if verdict.state == HIT && verdict.high < best.high {
                    rival = min(rival, best.low);
                    best = verdict;
                    prim = id;
                    t_end = min(t_end, best.high);
                } else if verdict.state != MISS && id != prim {
                    rival = min(rival, verdict.low);
                }
            }
            if query.any == 1u && prim != NONE {
                break;
            }
        }
        steps = w.steps;
        if query.any == 1u && prim != NONE {
            break;
        }
    }
    var state = best.state;
    if rival <= best.high && rival < FAR && !(query.any == 1u && prim != NONE) {
        state = UNSURE;
    }
    found[index] = Found(0.5 * (best.low + best.high), prim, state, steps.x, steps.y, steps.z, tests, 0u);
}
