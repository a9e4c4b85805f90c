/* A bake: its planes, its meshes in a scene of three.js, the charts of its UVs, and the texel under a point of the view. */
'use strict';

(function () {
    /* --- planes */

    async function inflate(bytes) {
        if (typeof DecompressionStream === 'undefined') {
            throw new Error('this browser is too old for the planes of a bake (it has no DecompressionStream)');
        }
        const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
        return new Uint8Array(await new Response(stream).arrayBuffer());
    }

    /* Reads a plane of halves: all high bytes, then all low ones. Each is stored as its difference from its left neighbour
     * (src/view/view.c). */
    async function readPlane(id, width, height) {
        const texels = width * height, bytes = await inflate(VIEW.block(id));
        if (bytes.length !== 2 * texels) {
            throw new Error('a plane is not as long as its size says');
        }
        const values = new Uint16Array(texels);
        for (let half = 0; half < 2; ++half) {
            for (let y = 0, i = 0; y < height; ++y) {
                for (let x = 0, last = 0; x < width; ++x, ++i) {
                    last = last + bytes[half * texels + i] & 255;
                    values[i] |= half === 0 ? last << 8 : last;
                }
            }
        }
        return values;
    }

    /* IEEE 754 binary16 to a number, by a table of all of them. */
    let numbers = null;
    function halves() {
        if (numbers === null) {
            numbers = new Float32Array(65536);
            for (let i = 0; i < 65536; ++i) {
                const exponent = i >> 10 & 31, fraction = i & 1023;
                const size = exponent === 0 ? fraction * 2 ** -24
                    : exponent === 31 ? (fraction ? NaN : Infinity) : (1 + fraction / 1024) * 2 ** (exponent - 15);
                numbers[i] = i & 32768 ? -size : size;
            }
        }
        return numbers;
    }

    /* The half nearest to a finite number of 0 … 65504, as bits. */
    function half(value) {
        if (!(value > 0)) {
            return 0;
        }
        const exponent = Math.max(Math.floor(Math.log2(value)), -14);
        const bits = (exponent + 14) * 1024 + Math.round(value * 2 ** (10 - exponent));
        return Math.min(bits, 31743);
    }

    /* --- the planes of a page of a bake */

    const byName = (page, name) => page.channels.find(channel => channel.name === name);

    /* Groups channels as they are shown: alone, or as three components by their last letter. */
    function groupsOf(page) {
        const groups = [];
        for (const channel of page.channels) {
            const found = /^(.*)\.([RGBXYZ])$/.exec(channel.name);
            const axes = found && 'RGB'.includes(found[2]) ? 'RGB' : 'XYZ';
            const three = found ? [...axes].map(axis => byName(page, found[1] + '.' + axis)) : [];
            if (found && three.every(Boolean)) {
                if (channel === three[0]) {
                    groups.push({name: found[1], channels: three, vector: axes === 'XYZ', light: axes === 'RGB'});
                }
            } else if (/^[RGB]$/.test(channel.name) && 'RGB'.split('').every(name => byName(page, name))) {
                if (channel.name === 'R') {
                    groups.push({name: 'RGB', channels: [...'RGB'].map(name => byName(page, name)), light: true});
                }
            } else {
                groups.push({name: channel.name, channels: [channel, channel, channel]});
            }
        }
        return groups;
    }

    /* The light of a page, as in EXR's picture (docs/formats.md): the irradiance, else R, G and B, else the mean of the
     * shadows times AO. */
    function pictureOf(page) {
        const groups = groupsOf(page);
        const named = groups.find(group => group.name === 'irradiance') || groups.find(group => group.name === 'RGB');
        if (named) {
            return named;
        }
        const shadows = groups.filter(group => group.name.startsWith('shadow.'));
        const ao = groups.find(group => group.name === 'ao');
        if (shadows.length === 0 && !ao) {
            return groups.find(group => group.name !== 'A') || null;
        }
        if (shadows.length + (ao ? 1 : 0) === 1) {
            return shadows[0] || ao;
        }
        if (!page.mean) {
            const number = halves(), values = new Uint16Array(page.width * page.height);
            for (let i = 0; i < values.length; ++i) {
                let sum = 0;
                for (const shadow of shadows) {
                    sum += number[shadow.channels[0].values[i]];
                }
                const light = shadows.length > 0 ? sum / shadows.length : 1;
                values[i] = half(ao ? light * number[ao.channels[0].values[i]] : light);
            }
            page.mean = {name: 'picture', values};
        }
        return {name: 'shadow × ao', channels: [page.mean, page.mean, page.mean]};
    }

    function groupOf(page, name) {
        return groupsOf(page).find(group => group.name === name) || null;
    }

    VIEW.loadPlanes = async function (bakes, tell) {
        for (const bake of bakes) {
            for (const page of bake.pages) {
                for (const channel of page.channels) {
                    tell(page.name + ': ' + channel.name);
                    channel.values = await readPlane(channel.data, page.width, page.height);
                }
            }
        }
    };

    /* --- charts and texel density of lightmap UVs */

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

    /* {count, colors, chart}: the charts of a thing, numbered from `first`, and the chart and colour of each vertex. */
    function chartsOf(drawn, first) {
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
    }

    /* Sums up a thing's areas in the world and in texels. */
    function areasOf(drawn, size) {
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
    }

    /* --- meshes that share arrays, each with a material that a mode sets */

    const ASSUMED = 1024; /* texels a side, where no lightmap says how many there are */
    const ONE = 0x3c00;   /* 1 as a half */

    /* Returns a function that finds the page of a thing: its image's place among all lightmaps. */
    function numberPages(loaded) {
        const sourceOf = drawn => {
            const {light, ao} = drawn.material;
            return light ? light.source : ao && ao.set === drawn.set ? ao.source : -1;
        };
        const sources = [...new Set(loaded.drawn.map(sourceOf))].filter(source => source >= 0).sort((a, b) => a - b);
        return drawn => Math.max(sources.indexOf(sourceOf(drawn)), 0);
    }

    function sizeOf(drawn, page) {
        const {light, ao} = drawn.material, image = light ? light.image : ao && ao.set === drawn.set ? ao.image : null;
        return page ? [page.width, page.height] : image ? [image.width, image.height] : [ASSUMED, ASSUMED];
    }

    function geometryOf(drawn, known) {
        const {arrays, material} = drawn;
        const uvAo = material.ao ? VIEW.movedUvs(arrays, material.ao.set, material.ao.matrix) : null;
        const key = [drawn.set, material.base && material.base.set, material.ao && material.ao.set,
            material.glow && material.glow.set].join();
        const of = known.get(arrays) || new Map();
        known.set(arrays, of);
        const same = of.get(key);
        if (!same || same.uvs !== drawn.uvs || same.uvAo !== uvAo) {
            const geometry = new THREE.BufferGeometry();
            const put = (name, array, size) => array && geometry.setAttribute(name, new THREE.BufferAttribute(array, size));
            const uvOf = map => map ? arrays.uvs[map.set] || null : null;
            put('position', arrays.position, 3);
            put('normal', arrays.normal, 3);
            put('uvLight', drawn.uvs, 2);
            put('uvBase', uvOf(material.base), 2);
            put('uvAo', uvAo, 2);
            put('uvGlow', uvOf(material.glow), 2);
            if (arrays.color) {
                const {array, size, count} = arrays.color, three = new Float32Array(3 * count);
                three.forEach((_, i) => { three[i] = array[size * Math.floor(i / 3) + i % 3]; });
                put('tint', three, 3);
            }
            geometry.setIndex(new THREE.BufferAttribute(arrays.indices, 1));
            geometry.computeBoundingSphere();
            of.set(key, {geometry, uvs: drawn.uvs, uvAo});
        }
        return of.get(key).geometry;
    }

    /* Makes the meshes of bake.scene. Bakes of one file share `loaded`, the result of VIEW.loadScene(). */
    VIEW.build = function (bake, loaded) {
        const pageOf = numberPages(loaded), known = loaded.geometries = loaded.geometries || new Map();
        bake.scene = new THREE.Scene();
        bake.loaded = loaded;
        bake.meshes = [];
        for (const drawn of loaded.drawn) {
            const page = bake.pages[Math.min(pageOf(drawn), bake.pages.length - 1)] || null;
            const size = sizeOf(drawn, page), geometry = geometryOf(drawn, known);
            const mesh = new THREE.Mesh(geometry,
                VIEW.shaderOf(drawn.material, drawn.arrays.color !== null, drawn.set >= 0, size, bake.perVertex === true));
            mesh.matrixAutoUpdate = false;
            mesh.matrix.copy(drawn.matrix);
            mesh.userData = {drawn, page, size};
            bake.meshes.push(mesh);
            bake.scene.add(mesh);
        }
        bake.scene.updateMatrixWorld(true);
    };

    /* A geometry that shares all arrays with another. */
    function withAttribute(geometry, name, attribute) {
        const made = new THREE.BufferGeometry();
        for (const [known, array] of Object.entries(geometry.attributes)) {
            made.setAttribute(known, array);
        }
        made.setAttribute(name, attribute);
        made.setIndex(geometry.index);
        made.boundingSphere = geometry.boundingSphere;
        return made;
    }

    /* Charts and density are found when they are first shown. */
    function needCharts(bake) {
        if (bake.charts !== undefined) {
            return;
        }
        bake.charts = 0;
        for (const mesh of bake.meshes) {
            const {drawn} = mesh.userData;
            if (drawn.set >= 0) {
                const found = chartsOf(drawn, bake.charts);
                mesh.geometry = withAttribute(mesh.geometry, 'chart', new THREE.BufferAttribute(found.colors, 3));
                mesh.userData.chart = found.chart;
                bake.charts += found.count;
            }
        }
    }

    function needDensity(bake) {
        if (bake.density !== undefined) {
            return;
        }
        let world = 0, texels = 0;
        for (const mesh of bake.meshes) {
            if (mesh.userData.drawn.set >= 0) {
                const areas = areasOf(mesh.userData.drawn, mesh.userData.size);
                world += areas.world;
                texels += areas.texels;
            }
        }
        bake.density = world > 0 ? Math.sqrt(texels / world) : 0;
    }

    /* The group of planes for a mode, or null. */
    function groupFor(page, mode, channel) {
        if (mode === 'lit') {
            return pictureOf(page);
        }
        if (mode === 'ao' || mode === 'bent') {
            return groupOf(page, mode);
        }
        if (mode === 'light') {
            return groupOf(page, channel);
        }
        if (mode === 'invalid') {
            const invalid = page.channels.find(c => c.name === 'invalid'), a = page.channels.find(c => c.name === 'A');
            return invalid || a ? {name: 'invalid and A', channels: [invalid, a, null], missing: [0, ONE, 0]} : null;
        }
        return null;
    }

    /* Names of the channels in mode `light`, the lights first. */
    VIEW.lightsOf = function (bake) {
        const names = bake.pages.length > 0 ? groupsOf(bake.pages[0]).map(group => group.name) : [];
        const first = names.filter(name => /^(irradiance|RGB|shadow\.|tint\.|sky$)/.test(name));
        const list = [...first, ...names.filter(name => !first.includes(name) && name !== 'ao' && name !== 'bent')];
        return bake.meshes.some(mesh => mesh.userData.drawn.material.light) ? ['lightmap', ...list] : list;
    };

    /* Whether a bake has something to show in a mode. */
    VIEW.has = function (bake, mode) {
        const uv = bake.meshes.some(mesh => mesh.userData.drawn.set >= 0);
        const page = bake.pages[0], known = uv || bake.perVertex;
        switch (mode) {
        case 'lit':
        case 'base':
            return true;
        case 'ao':
            return Boolean(page && known && groupFor(page, 'ao')) || bake.meshes.some(m => m.userData.drawn.material.ao);
        case 'light':
            return known && VIEW.lightsOf(bake).length > 0;
        case 'bent':
        case 'invalid':
            return Boolean(page && known && groupFor(page, mode));
        default:
            return uv;
        }
    };

    VIEW.show = function (bake, state) {
        if (state.mode === 'charts') {
            needCharts(bake);
        }
        if (state.mode === 'density') {
            needDensity(bake);
        }
        for (const mesh of bake.meshes) {
            const {page} = mesh.userData, material = mesh.material, u = material.uniforms;
            const group = page && state.channel !== 'lightmap' || page && state.mode !== 'light'
                ? groupFor(page, state.mode, state.channel) : null;
            const sharp = state.texels || state.mode === 'invalid';
            const filter = sharp ? THREE.NearestFilter : THREE.LinearFilter;
            u.mode.value = VIEW.MODE[state.mode];
            u.hasPlane.value = group !== null;
            u.encode.value = group !== null && group.light === true;
            u.gain.value = 2 ** state.exposure;
            u.reference.value = bake.density || 1;
            u.hasLight.value = mesh.userData.drawn.material.light !== null &&
                (state.mode !== 'light' || state.channel === 'lightmap');
            if (group !== null) {
                u.plane.value = VIEW.planeTexture(page, group);
            }
            for (const texture of [u.plane.value, u.lightMap.value, u.aoMap.value]) {
                if (texture.image && texture.image.width > 1 && texture.magFilter !== filter) {
                    texture.magFilter = texture.minFilter = filter;
                    texture.needsUpdate = true;
                }
            }
            const through = material.userData.blended && (state.mode === 'lit' || state.mode === 'base');
            if (material.transparent !== through) {
                material.transparent = through;
                material.depthWrite = !through;
                material.needsUpdate = true;
            }
            material.wireframe = state.wireframe;
            material.side = state.sides ? THREE.DoubleSide : material.userData.side;
        }
    };

    /* --- picking */

    const raycaster = new THREE.Raycaster();

    /* A texel's coordinate within 0 … count - 1, repeated. */
    const wrap = (x, count) => ((Math.floor(x) % count) + count) % count;

    /* Finds the texel of a bake at (x, y), normalized device coordinates; null: none. */
    VIEW.pick = function (bake, camera, x, y) {
        camera.updateMatrixWorld();
        raycaster.setFromCamera({x, y}, camera);
        const hit = raycaster.intersectObjects(bake.meshes, false)[0];
        if (!hit) {
            return null;
        }
        const {drawn, page, size, chart} = hit.object.userData, vertices = [hit.face.a, hit.face.b, hit.face.c];
        const found = {bake, object: hit.object, drawn, page, size, point: hit.point, triangle: hit.faceIndex,
            chart: chart ? chart[vertices[0]] : null, uv: null, texel: null, weights: null, vertices};
        if (drawn.set >= 0 || bake.perVertex) {
            const corner = k => new THREE.Vector3().fromArray(drawn.arrays.position, 3 * vertices[k]).applyMatrix4(drawn.matrix);
            const weights = new THREE.Vector3();
            new THREE.Triangle(corner(0), corner(1), corner(2)).getBarycoord(hit.point, weights);
            found.weights = weights.toArray();
        }
        if (drawn.set >= 0) {
            const uv = drawn.uvs, w = found.weights;
            found.uv = [0, 1].map(axis => vertices.reduce((sum, vertex, k) => sum + w[k] * uv[2 * vertex + axis], 0));
            found.texel = found.uv.map((value, axis) => wrap(value * size[axis], size[axis]));
        }
        return found;
    };

    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = 1;

    /* R, G, B, A of an image's pixel, 0 … 255. */
    function pixel(image, u, v) {
        const context = canvas.getContext('2d', {willReadFrequently: true});
        const x = wrap(u * image.width, image.width), y = wrap(v * image.height, image.height);
        context.clearRect(0, 0, 1, 1);
        context.drawImage(image, -x, -y);
        return context.getImageData(0, 0, 1, 1).data;
    }

    /* [[name, text]] of a picked texel's values. */
    VIEW.values = function (found) {
        const list = [], number = halves(), {material} = found.drawn;
        const text = value => Number.isFinite(value) ? String(+value.toPrecision(4)) : String(value);
        if (found.page && (found.texel || found.bake.perVertex)) {
            const at = found.texel ? [found.texel[1] * found.page.width + found.texel[0]] : found.vertices;
            const weights = found.texel ? [1] : found.weights;
            const mean = channel => at.reduce((sum, place, k) => sum + weights[k] * number[channel.values[place]], 0);
            for (const group of groupsOf(found.page)) {
                const values = [...new Set(group.channels)].map(channel => text(mean(channel)));
                list.push([group.name, values.join('  ')]);
            }
        }
        for (const [name, map] of [['lightmap', material.light], ['occlusion', material.ao]]) {
            const uv = map && map.set === found.drawn.set ? found.uv : null;
            if (uv) {
                const rgb = [...pixel(map.image, uv[0], uv[1])].slice(0, 3);
                list.push([name + ' / 255', name === 'occlusion' ? String(rgb[0]) : rgb.join('  ')]);
            }
        }
        return list;
    };
})();
