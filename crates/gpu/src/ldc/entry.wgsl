// Where all ways to trace rays begin: a thread a ray, and what the way's `answer` says of it.

@compute @workgroup_size(64)
fn trace(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
         @builtin(local_invocation_index) local: u32) {
    let index = thread_index(group, groups, local, 64u);
    if index < query.rays {
        found[index] = answer(index, rays[index]);
    }
}
