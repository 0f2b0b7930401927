// Exclusive prefix sums in place, in blocks of 1024, and the largest of all numbers.

struct Scan {
    count: u32,
    blocks: u32,
    pad: vec2u,
}

@group(0) @binding(0) var<uniform> scan: Scan;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@group(0) @binding(2) var<storage, read_write> sums: array<u32>;
@group(0) @binding(3) var<storage, read_write> most: array<atomic<u32>>;

var<workgroup> shared_sums: array<u32, 256>;

// Inclusive sums over the threads of a workgroup.
fn scanned(local: u32, value: u32) -> u32 {
    shared_sums[local] = value;
    workgroupBarrier();
    for (var step = 1u; step < 256u; step *= 2u) {
        var sum = shared_sums[local];
        if local >= step {
            sum += shared_sums[local - step];
        }
        workgroupBarrier();
        shared_sums[local] = sum;
        workgroupBarrier();
    }
    return shared_sums[local];
}

fn value_at(i: u32) -> u32 {
    return select(0u, values[min(i, scan.count - 1u)], i < scan.count);
}

@compute @workgroup_size(256)
fn reduce(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
          @builtin(local_invocation_index) local: u32) {
    let block = group.y * groups.x + group.x;
    let first = (block * 256u + local) * 4u;
    let v = vec4u(value_at(first), value_at(first + 1u), value_at(first + 2u), value_at(first + 3u));
    let sum = scanned(local, v.x + v.y + v.z + v.w);
    if local == 255u && block < scan.blocks {
        sums[block] = sum;
    }
    let top = max(max(v.x, v.y), max(v.z, v.w));
    if top > atomicLoad(&most[0]) {
        atomicMax(&most[0], top);
    }
}

@compute @workgroup_size(256)
fn blocks(@builtin(local_invocation_index) local: u32) {
    var before = 0u;
    for (var first = 0u; first < scan.blocks; first += 256u) {
        let i = first + local;
        let own = select(0u, sums[min(i, scan.blocks - 1u)], i < scan.blocks);
        let sum = scanned(local, own);
        if i < scan.blocks {
            sums[i] = before + sum - own;
        }
        before += shared_sums[255];
        workgroupBarrier();
    }
}

@compute @workgroup_size(256)
fn spread(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
          @builtin(local_invocation_index) local: u32) {
    let block = group.y * groups.x + group.x;
    let first = (block * 256u + local) * 4u;
    let v = vec4u(value_at(first), value_at(first + 1u), value_at(first + 2u), value_at(first + 3u));
    let own = v.x + v.y + v.z + v.w;
    let sum = scanned(local, own) - own;
    if block >= scan.blocks {
        return;
    }
    var before = sums[block] + sum;
    for (var i = 0u; i < 4u; i++) {
        if first + i < scan.count {
            values[first + i] = before;
        }
        before += v[i];
    }
}
