// Hits by the samples alone (VMV07): `trace/src/ldc/sampled.rs` in f32.

const STRICT: u32 = 0u;
const INTERVAL: u32 = 1u;
const PLANE: u32 = 2u;

// Parameter at which a sample is hit; FAR if it is not.
fn sample_hit(w: Walk, depth: f32, slopes: vec2f, lateral: f32) -> f32 {
    let length = w.ends.y - w.ends.x;
    let depths = w.origin.z + w.ends * w.dir.z;
    if query.test == STRICT {
        let middle = 0.5 * (w.ends.x + w.ends.y);
        let off = w.origin + middle * w.dir - vec3f(vec2f(w.at) + 0.5, depth);
        return select(FAR, middle, dot(off, off) < query.tolerance * query.tolerance);
    }
    if query.test == INTERVAL {
        let low = min(depths.x, depths.y) - query.tolerance;
        let high = max(depths.x, depths.y) + query.tolerance;
        let rise = depths.y - depths.x;
        var share = 0.0;
        if rise != 0.0 {
            share = clamp((depth - depths.x) / rise, 0.0, 1.0);
        }
        return select(FAR, w.ends.x + length * share, depth >= low && depth <= high);
    }
    let off = above(w, depth, slopes);
    let rise = off.y - off.x;
    if rise == 0.0 || length <= 0.0 {
        return FAR;
    }
    let t = w.ends.x - off.x * (length / rise);
    let slack = query.tolerance * lateral;
    return select(FAR, t, t >= w.ends.x - slack && t <= w.ends.y + slack);
}

fn answer(index: u32, ray: Ray) -> Found {
    // A plane's slopes are at most 1 either way.
    let pad = query.tolerance * select(1.0, 2.0, query.test == PLANE);
    let order = axis_order(ray.dir);
    var best = FAR;
    var prim = NONE;
    var steps = vec3u(0u);
    var t_end = ray.end;
    for (var i = 0u; i < 3u; i++) {
        var w = walk_start(ray, order[i], steps);
        let lateral = 1.0 / max(length(w.dir.xy), 1e-20);
        // Beyond its texel the ray has other depths.
        let beyond = query.tolerance * (2.0 + 1.01 * abs(w.dir.z) * lateral);
        let reach = select(query.tolerance + 0.015625, PLANE_REACH + beyond, query.test == PLANE);
        var own = FAR;
        var own_prim = NONE;
        while own == FAR && walk_next(&w, t_end, pad) {
            var near = near_ray(w, reach);
            for (var sample = next_near(&w, &near); sample.id != NONE; sample = next_near(&w, &near)) {
                let id = sample.id;
                let t = sample_hit(w, sample.depth, slopes_of(sample.slopes), lateral);
                let counts = t < FAR && t > ray.t_min && t <= ray.t_max && id != ray.skip;
                if counts && (t < own || (t == own && id < own_prim)) {
                    own = t;
                    own_prim = id;
                }
            }
        }
        steps = w.steps;
        t_end = min(t_end, own);
        if own < best || (own == best && own_prim < prim) {
            best = own;
            prim = own_prim;
        }
        if query.any == 1u && prim != NONE {
            break;
        }
    }
    return Found(best, prim, select(HIT, MISS, prim == NONE), steps.x, steps.y, steps.z, 0u, 0u);
}
