/* What can be told of lightmap UVs: charts, texel density. */
'use strict';

(function () {
    /* Vertices that are one in space and in the lightmap: numbers from 0, by an open hash of their bits. */
    function weld(position, uv, count) {
        const values = [new Uint32Array(position.buffer, position.byteOffset, 3 * count),
            new Uint32Array(uv.buffer, uv.byteOffset, 2 * count)];
        let capacity = 16;
        while (capacity < 2 * count) {
            capacity *= 2;
        }
        const table = new Int32Array(capacity).fill(-1), welded = new Uint32Array(count);
        const same = (a, b) => values[0][3 * a] === values[0][3 * b] && values[0][3 * a + 1] === values[0][3 * b + 1] &&
            values[0][3 * a + 2] === values[0][3 * b + 2] && values[1][2 * a] === values[1][2 * b] &&
            values[1][2 * a + 1] === values[1][2 * b + 1];
        for (let i = 0; i < count; ++i) {
            let hash = 0;
            for (const word of [values[0][3 * i], values[0][3 * i + 1], values[0][3 * i + 2], values[1][2 * i],
                values[1][2 * i + 1]]) {
                hash = Math.imul(hash ^ word, 0x9e3779b1);
                hash ^= hash >>> 15;
            }
            let place = (hash >>> 0) % capacity;
            while (table[place] >= 0 && !same(table[place], i)) {
                place = (place + 1) % capacity;
            }
            if (table[place] < 0) {
                table[place] = i;
            }
            welded[i] = table[place];
        }
        return welded;
    }

    /* A hue for each number, neighbours far apart. */
    function hueOf(number) {
        const hue = number * 0.618033988749895 % 1, light = 0.52 + 0.16 * (number * 0.7548776662 % 1);
        return new THREE.Color().setHSL(hue, 0.62, light);
    }

    /* {count, colors, chart}: the charts of a drawn thing, numbered from `first`; `chart` is of each vertex. */
    VIEW.chartsOf = function (drawn, first) {
        const {arrays, uvs: uv} = drawn, count = arrays.count, indices = arrays.indices;
        const parent = weld(arrays.position, uv, count);
        const find = i => {
            while (parent[i] !== i) {
                parent[i] = parent[parent[i]];
                i = parent[i];
            }
            return i;
        };
        for (let i = 0; i < indices.length; i += 3) {
            const a = find(indices[i]);
            for (const other of [indices[i + 1], indices[i + 2]]) {
                const b = find(other);
                if (a !== b) {
                    parent[Math.max(find(a), b)] = Math.min(find(a), b);
                }
            }
        }
        const numbers = new Map(), chart = new Uint32Array(count), colors = new Float32Array(3 * count);
        for (let i = 0; i < indices.length; ++i) {
            const vertex = indices[i], root = find(vertex);
            if (!numbers.has(root)) {
                numbers.set(root, first + numbers.size);
            }
            chart[vertex] = numbers.get(root);
        }
        let last = -1, color = null;
        for (let i = 0; i < count; ++i) {
            if (chart[i] !== last || color === null) {
                last = chart[i];
                color = hueOf(last);
            }
            color.toArray(colors, 3 * i);
        }
        return {count: numbers.size, chart, colors};
    };

    /* Areas in the world and in texels of all that is drawn. */
    VIEW.areasOf = function (drawn, size) {
        const {arrays, matrix, uvs: uv} = drawn, p = [0, 1, 2].map(() => new THREE.Vector3());
        let world = 0, texels = 0;
        for (let i = 0; i < arrays.indices.length; i += 3) {
            const [a, b, c] = arrays.indices.subarray(i, i + 3);
            [a, b, c].forEach((vertex, k) => p[k].fromArray(arrays.position, 3 * vertex).applyMatrix4(matrix));
            world += p[1].sub(p[0]).cross(p[2].sub(p[0])).length() / 2;
            texels += Math.abs((uv[2 * b] - uv[2 * a]) * (uv[2 * c + 1] - uv[2 * a + 1]) -
                (uv[2 * c] - uv[2 * a]) * (uv[2 * b + 1] - uv[2 * a + 1])) / 2 * size[0] * size[1];
        }
        return {world, texels};
    };
})();
