// Shell sort of what `load` and `store` reach, in the order of `before`; insertion sort where there is little.

fn shell_sort(first: u32, count: u32) {
    var gap = 1u;
    while gap < count / 3u {
        gap = 3u * gap + 1u;
    }
    while gap > 0u {
        for (var i = gap; i < count; i++) {
            let moved = load(first + i);
            var j = i;
            while j >= gap && before(moved, load(first + j - gap)) {
                store(first + j, load(first + j - gap));
                j -= gap;
            }
            store(first + j, moved);
        }
        gap /= 3u;
    }
}
