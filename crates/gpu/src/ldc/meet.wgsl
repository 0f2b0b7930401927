// What is known of a ray and a triangle in f32.
//
// With u = 2^-24 and a cube of S texels, corners and the ray's point are known to 5 u S in texel coordinates. Relative
// to that point the edge functions are `d . (a x b)` with |d| <= 1 in each component and |a|, |b| <= A, so they are
// known to 12 A (5 u S + u A) for the positions, 6 u A^2 for the direction and 42 u A^2 for the sums: within
// 64 u A (S + A). Corners that the device itself has turned into coordinates are known to 3 u S instead of u S, which
// makes it 12 A (7 u S + u A): within 96 u A (S + A). `frame.doubt` is 64 or 96. A hit's parameter follows from them as
// weights of the corners' parameters. The definition of the answer, `trace::exact`, has its own error of 2^-22 of the
// parameter from the ray's true origin.

@group(0) @binding(1) var<storage, read> positions: array<f32>;
@group(0) @binding(2) var<storage, read> indices: array<u32>;

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
    let error = frame.doubt * ULP * reach * size + 1e-30;
    let e = vec3f(dot(ray.dir, cross(b, c)), dot(ray.dir, cross(c, a)), dot(ray.dir, cross(a, b)));
    let low = min(min(e.x, e.y), e.z);
    let high = max(max(e.x, e.y), e.z);
    if low < -error && high > error {
        return Verdict(MISS, 0.0, 0.0);
    }
    let q = vec3f(dot(ray.dir, a), dot(ray.dir, b), dot(ray.dir, c)) / dot(ray.dir, ray.dir);
    let q_low = min(min(q.x, q.y), q.z);
    let q_high = max(max(q.x, q.y), q.z);
    let slack = 0.5 * frame.doubt * ULP * size + 5.0 * ULP * (ray.before + t + reach);
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

// The certain hit with the least upper bound, and the least lower bound of all others.
struct Best {
    verdict: Verdict,
    prim: u32,
    rival: f32,
}

// Takes a triangle into account; true if it is the best now.
fn improve(best: ptr<function, Best>, verdict: Verdict, prim: u32) -> bool {
    if verdict.state == HIT && verdict.high < (*best).verdict.high {
        (*best).rival = min((*best).rival, (*best).verdict.low);
        (*best).verdict = verdict;
        (*best).prim = prim;
        return true;
    }
    if verdict.state != MISS && prim != (*best).prim {
        (*best).rival = min((*best).rival, verdict.low);
    }
    return false;
}

// Whether any hit will do and there is one.
fn settled(best: Best) -> bool {
    return query.any == 1u && best.prim != NONE;
}

// The answer: UNSURE if another triangle may be hit before the best.
fn state_of(best: Best) -> u32 {
    let rivalled = best.rival <= best.verdict.high && best.rival < FAR && !settled(best);
    return select(best.verdict.state, UNSURE, rivalled);
}

// What is found of a ray.
fn told(best: Best, steps: vec3u, tests: u32) -> Found {
    let t = 0.5 * (best.verdict.low + best.verdict.high);
    return Found(t, best.prim, state_of(best), steps.x, steps.y, steps.z, tests, 0u);
}
