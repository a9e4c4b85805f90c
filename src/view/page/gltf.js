/* A glTF file of the page as things to draw: {name, material, arrays, matrix, set, uvs}, with skins and morph targets at
 * rest, as vdbshade bakes them. The loader of three.js r111 knows two UV sets and no MOZ_lightmap; this one reads all eight.
 * The file has passed vdbshade's own reader, but the rest of it may be anything. */
'use strict';

const VIEW = {};

(function () {
    /* --- arrays and images (glTF 2.0) */

    /* Base64 characters that are decoded at a time: a multiple of four. */
    const PIECE = 1 << 20;

    /* The bytes of a data block of this page. */
    VIEW.block = function (id) {
        const element = document.getElementById(id);
        const text = element.textContent;
        const pad = text.endsWith('==') ? 2 : text.endsWith('=') ? 1 : 0;
        const bytes = new Uint8Array(text.length / 4 * 3 - pad);
        let at = 0;
        for (let i = 0; i < text.length; i += PIECE) {
            const piece = atob(text.slice(i, i + PIECE));
            for (let k = 0; k < piece.length; ++k) {
                bytes[at++] = piece.charCodeAt(k);
            }
        }
        element.remove(); /* frees half of the memory */
        return bytes;
    };

    /* Type, and the number that stands for a normalized 1. */
    const COMPONENTS = {
        5120: [Int8Array, 127], 5121: [Uint8Array, 255], 5122: [Int16Array, 32767], 5123: [Uint16Array, 65535],
        5125: [Uint32Array, 4294967295], 5126: [Float32Array, 1]
    };
    const SIZES = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16};

    function at(list, index, what) {
        if (!Array.isArray(list) || !(index >= 0 && index < list.length)) {
            throw new Error(what + ' ' + index + ' is not there');
        }
        return list[index];
    }

    /* `named`: the bytes of files that the glTF names, by their URIs. */
    function openFile(bytes, named) {
        const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
        let text = bytes, body = new Uint8Array(0);
        if (bytes.length >= 20 && view.getUint32(0, true) === 0x46546c67) {
            const next = 20 + view.getUint32(12, true);
            text = bytes.subarray(20, next);
            body = next + 8 <= bytes.length ? bytes.subarray(next + 8, next + 8 + view.getUint32(next, true)) : body;
        }
        const json = JSON.parse(new TextDecoder().decode(text));
        return {json, body, named, arrays: new Map(), buffers: new Map(), images: new Map(), problems: new Set()};
    }

    function bytesAt(file, uri) {
        if (file.named.has(uri)) {
            return file.named.get(uri);
        }
        const found = /^data:[^,]*;base64,/.exec(uri);
        if (!found) {
            throw new Error('a file that it names is not in the page: ' + String(uri).slice(0, 100));
        }
        return Uint8Array.from(atob(uri.slice(found[0].length)), c => c.charCodeAt(0));
    }

    function bytesOf(file, index) {
        const view = at(file.json.bufferViews, index, 'bufferView');
        const buffer = at(file.json.buffers, view.buffer, 'buffer');
        if (buffer.uri !== undefined && !file.buffers.has(view.buffer)) {
            file.buffers.set(view.buffer, bytesAt(file, buffer.uri));
        }
        const bytes = buffer.uri !== undefined ? file.buffers.get(view.buffer) : file.body;
        const begin = view.byteOffset || 0;
        if (!(begin >= 0 && view.byteLength >= 0 && begin + view.byteLength <= bytes.length)) {
            throw new Error('bufferView ' + index + ' is longer than its buffer');
        }
        return {bytes: bytes.subarray(begin, begin + view.byteLength), stride: view.byteStride || 0};
    }

    /* Elements as they are stored, one after the other. */
    function elements(file, viewIndex, offset, Type, size, count) {
        const {bytes, stride} = bytesOf(file, viewIndex);
        const item = size * Type.BYTES_PER_ELEMENT, step = stride || item;
        if (!(offset >= 0 && count >= 0 && (count === 0 || offset + (count - 1) * step + item <= bytes.length))) {
            throw new Error('an accessor reaches beyond bufferView ' + viewIndex);
        }
        const packed = new Uint8Array(count * item);
        if (step === item) {
            packed.set(bytes.subarray(offset, offset + count * item));
        } else {
            for (let i = 0; i < count; ++i) {
                packed.set(bytes.subarray(offset + i * step, offset + i * step + item), i * item);
            }
        }
        return new Type(packed.buffer);
    }

    function componentOf(a) {
        const component = COMPONENTS[a.componentType];
        if (!component) {
            throw new Error('an accessor is of no type that there is');
        }
        return component;
    }

    /* Replaces the elements of a sparse accessor. */
    function overlay(file, a, Type, size, array) {
        const [IndexType] = componentOf(a.sparse.indices);
        const indices = elements(file, a.sparse.indices.bufferView, a.sparse.indices.byteOffset || 0, IndexType, 1,
            a.sparse.count);
        const values = elements(file, a.sparse.values.bufferView, a.sparse.values.byteOffset || 0, Type, size,
            a.sparse.count);
        for (let i = 0; i < indices.length; ++i) {
            for (let k = 0; k < size && indices[i] < a.count; ++k) {
                array[size * indices[i] + k] = values[size * i + k];
            }
        }
    }

    /* {array, size, count}: floats, or of indices (`raw`) the integers. */
    function accessor(file, index, raw) {
        const key = (raw ? 'raw ' : '') + index;
        if (file.arrays.has(key)) {
            return file.arrays.get(key);
        }
        const a = at(file.json.accessors, index, 'accessor'), size = SIZES[a.type], [Type, most] = componentOf(a);
        if (!size) {
            throw new Error('accessor ' + index + ' is of no type that there is');
        }
        let array = a.bufferView !== undefined
            ? elements(file, a.bufferView, a.byteOffset || 0, Type, size, a.count) : new Type(size * a.count);
        if (a.sparse) {
            overlay(file, a, Type, size, array);
        }
        if (!raw && Type !== Float32Array) {
            array = Float32Array.from(array, a.normalized ? value => Math.max(value / most, -1) : value => value);
        }
        const made = {array, size, count: a.count};
        file.arrays.set(key, made);
        return made;
    }

    /* A decoded image, without colour conversion; null, with an entry in file.problems, if that fails. */
    async function image(file, index) {
        if (!file.images.has(index)) {
            let made = null;
            try {
                const source = at(file.json.images, index, 'image');
                const bytes = source.bufferView !== undefined ? bytesOf(file, source.bufferView).bytes
                    : bytesAt(file, source.uri);
                made = await createImageBitmap(new Blob([bytes], {type: source.mimeType || ''}),
                    {premultiplyAlpha: 'none', colorSpaceConversion: 'none'});
            } catch (error) {
                file.problems.add('image ' + index + ' is not shown: ' + error.message);
            }
            file.images.set(index, made);
        }
        return file.images.get(index);
    }

    /* --- materials and textures, as far as they are shown */

    const WRAP = {33071: THREE.ClampToEdgeWrapping, 33648: THREE.MirroredRepeatWrapping, 10497: THREE.RepeatWrapping};
    const FILTER = {9728: THREE.NearestFilter};

    /* {set, matrix} of a texture info: the set of UVs and their transform. */
    function layoutOf(info) {
        const transform = (info.extensions || {}).KHR_texture_transform || {};
        const matrix = new THREE.Matrix3();
        const [sx, sy] = transform.scale || [1, 1], [x, y] = transform.offset || [0, 0];
        const c = Math.cos(transform.rotation || 0), s = Math.sin(transform.rotation || 0);
        matrix.set(sx * c, sy * s, x, -sx * s, sy * c, y, 0, 0, 1);
        return {set: transform.texCoord !== undefined ? transform.texCoord : info.texCoord || 0, matrix};
    }

    /* Formats that browsers can decode, and formats that they cannot. */
    const SHOWN = ['EXT_texture_webp', 'EXT_texture_avif'], OTHERS = ['KHR_texture_basisu', 'MSFT_texture_dds'];

    /* The number of a texture's image. If no browser can show it, says so and returns undefined. */
    function imageOf(file, index, definition) {
        const extensions = definition.extensions || {};
        const sources = [definition, ...SHOWN.map(name => extensions[name])].filter(at => at && at.source !== undefined);
        if (sources.length === 0) {
            const other = OTHERS.find(name => extensions[name]);
            file.problems.add('texture ' + index + ' is not shown: ' +
                (other ? 'browsers do not read the images of ' + other : 'it names no image'));
            return undefined;
        }
        return sources[0].source;
    }

    /* {texture, image, source, set, matrix} of a texture info; null without an image. */
    async function texture(file, info, mipmaps) {
        if (!info || info.index === undefined) {
            return null;
        }
        const definition = at(file.json.textures, info.index, 'texture');
        const source = imageOf(file, info.index, definition);
        const bitmap = source !== undefined ? await image(file, source) : null;
        if (bitmap === null) {
            return null;
        }
        const sampler = definition.sampler !== undefined
            ? at(file.json.samplers, definition.sampler, 'sampler') : {};
        const made = new THREE.Texture(bitmap);
        made.flipY = false;
        made.generateMipmaps = mipmaps;
        made.magFilter = FILTER[sampler.magFilter] || THREE.LinearFilter;
        made.minFilter = mipmaps ? THREE.LinearMipmapLinearFilter : THREE.LinearFilter;
        made.anisotropy = mipmaps ? 4 : 1;
        made.wrapS = WRAP[sampler.wrapS] || THREE.RepeatWrapping;
        made.wrapT = WRAP[sampler.wrapT] || THREE.RepeatWrapping;
        made.needsUpdate = true;
        return {texture: made, image: bitmap, source, ...layoutOf(info)};
    }

    async function materialOf(file, index) {
        const m = index !== undefined ? at(file.json.materials, index, 'material') : {};
        const pbr = m.pbrMetallicRoughness || {}, extensions = m.extensions || {};
        const lightmap = extensions.MOZ_lightmap;
        const strength = (extensions.KHR_materials_emissive_strength || {}).emissiveStrength;
        const glossy = extensions.KHR_materials_pbrSpecularGlossiness || {};
        const infos = [m.occlusionTexture, pbr.baseColorTexture, glossy.diffuseTexture, pbr.metallicRoughnessTexture,
            m.normalTexture, m.emissiveTexture];
        return {
            layouts: infos.filter(info => info).map(layoutOf),
            name: m.name || '',
            color: pbr.baseColorFactor || glossy.diffuseFactor || (index !== undefined ? [1, 1, 1, 1] : [0.8, 0.8, 0.8, 1]),
            base: await texture(file, pbr.baseColorTexture || glossy.diffuseTexture, true),
            emissive: (m.emissiveFactor || [0, 0, 0]).map(value => value * (strength === undefined ? 1 : strength)),
            glow: await texture(file, m.emissiveTexture, true),
            ao: await texture(file, m.occlusionTexture, false),
            strength: m.occlusionTexture && m.occlusionTexture.strength !== undefined ? m.occlusionTexture.strength : 1,
            light: await texture(file, lightmap, false),
            intensity: lightmap && lightmap.intensity !== undefined ? lightmap.intensity : 1,
            unlit: extensions.KHR_materials_unlit !== undefined,
            alphaMode: m.alphaMode || 'OPAQUE',
            cutoff: m.alphaMode === 'MASK' ? (m.alphaCutoff !== undefined ? m.alphaCutoff : 0.5) : -1,
            doubleSided: m.doubleSided === true
        };
    }

    /* --- meshes and nodes */

    const MOST_DEPTH = 1024, UV_SETS = 8, TRIANGLES = 4, STRIP = 5, FAN = 6, FLOAT = 5126;

    function indicesOf(file, primitive, count) {
        const given = primitive.indices !== undefined
            ? accessor(file, primitive.indices, true).array : Uint32Array.from({length: count}, (_, i) => i);
        const mode = primitive.mode === undefined ? TRIANGLES : primitive.mode;
        if (given.some(index => index >= count)) {
            throw new Error('an index is out of range');
        }
        if (mode === TRIANGLES) {
            return new Uint32Array(given.subarray(0, given.length - given.length % 3));
        }
        const list = [];
        for (let i = 2; mode === STRIP && i < given.length; ++i) {
            list.push(given[i - 2], given[i - 1 + i % 2], given[i - i % 2]);
        }
        for (let i = 2; mode === FAN && i < given.length; ++i) {
            list.push(given[0], given[i - 1], given[i]);
        }
        return Uint32Array.from(list); /* points and lines: none */
    }

    /* The arrays of a primitive, with the morph targets at their weights. */
    function arraysOf(file, primitive, weights) {
        const attributes = primitive.attributes || {};
        if ((primitive.extensions || {}).KHR_draco_mesh_compression) {
            throw new Error('it is compressed (Draco)');
        }
        if (attributes.POSITION === undefined) {
            return null;
        }
        const get = name => attributes[name] !== undefined ? accessor(file, attributes[name], false) : null;
        const moved = name => {
            const given = get(name), targets = primitive.targets || [];
            if (!given || !weights || !targets.some((target, i) => target[name] !== undefined && weights[i])) {
                return given;
            }
            const array = given.array.slice();
            targets.forEach((target, i) => {
                if (target[name] !== undefined && weights[i]) {
                    const more = accessor(file, target[name], false).array;
                    for (let k = 0; k < array.length; ++k) {
                        array[k] += weights[i] * more[k];
                    }
                }
            });
            return {array, size: given.size, count: given.count};
        };
        const position = moved('POSITION'), uvs = [], integers = [];
        for (let set = 0; set < UV_SETS; ++set) {
            const uv = get('TEXCOORD_' + set);
            uvs.push(uv && uv.count === position.count ? uv.array : null);
            integers.push(uv !== null && file.json.accessors[attributes['TEXCOORD_' + set]].componentType !== FLOAT);
        }
        const color = get('COLOR_0'), normal = moved('NORMAL');
        return {
            position: position.array, count: position.count,
            normal: normal && normal.count === position.count ? normal.array : null, uvs,
            integers, moved: new Map(),
            color: color && color.count === position.count ? color : null,
            indices: indicesOf(file, primitive, position.count), joints: get('JOINTS_0'), weights: get('WEIGHTS_0')
        };
    }

    /* Moves positions and normals into the world by the joints' matrices. */
    function pose(file, arrays, skin, worlds) {
        const bind = skin.inverseBindMatrices !== undefined
            ? accessor(file, skin.inverseBindMatrices, false).array : null;
        const joints = skin.joints.map((node, i) => {
            const world = worlds[node] ? worlds[node].clone() : new THREE.Matrix4();
            return bind ? world.multiply(new THREE.Matrix4().fromArray(bind, 16 * i)) : world;
        });
        const position = new Float32Array(arrays.position.length);
        const normal = arrays.normal ? new Float32Array(position.length) : null;
        const from = new THREE.Vector3(), to = new THREE.Vector3(), sum = new THREE.Vector3();
        const move = (source, target, i, apply) => {
            sum.set(0, 0, 0);
            for (let k = 0; k < 4; ++k) {
                const weight = arrays.weights.array[4 * i + k], joint = joints[arrays.joints.array[4 * i + k]];
                if (weight && joint) {
                    sum.addScaledVector(apply(to.copy(from.fromArray(source, 3 * i)), joint), weight);
                }
            }
            sum.toArray(target, 3 * i);
        };
        for (let i = 0; i < arrays.count; ++i) {
            move(arrays.position, position, i, (v, joint) => v.applyMatrix4(joint));
            if (normal) {
                move(arrays.normal, normal, i, (v, joint) => v.transformDirection(joint));
            }
        }
        return Object.assign({}, arrays, {position, normal});
    }

    function localOf(node) {
        if (Array.isArray(node.matrix)) {
            return new THREE.Matrix4().fromArray(node.matrix);
        }
        return new THREE.Matrix4().compose(new THREE.Vector3().fromArray(node.translation || [0, 0, 0]),
            new THREE.Quaternion().fromArray(node.rotation || [0, 0, 0, 1]),
            new THREE.Vector3().fromArray(node.scale || [1, 1, 1]));
    }

    /* The world's matrix of each node that a scene shows. */
    function placeNodes(file) {
        const json = file.json, worlds = [];
        const roots = json.scenes ? at(json.scenes, json.scene || 0, 'scene').nodes || [] : [];
        const visit = (index, parent, depth) => {
            const node = at(json.nodes, index, 'node');
            if (depth > MOST_DEPTH || worlds[index]) {
                throw new Error('nodes go in a circle');
            }
            worlds[index] = parent.clone().multiply(localOf(node));
            for (const child of node.children || []) {
                visit(child, worlds[index], depth + 1);
            }
        };
        roots.forEach(root => visit(root, new THREE.Matrix4(), 0));
        return worlds;
    }

    /* World matrices of a node's instances (EXT_mesh_gpu_instancing), or of the node itself. */
    function placesOf(file, node, world) {
        const given = ((node.extensions || {}).EXT_mesh_gpu_instancing || {}).attributes;
        if (!given) {
            return [world];
        }
        const get = name => given[name] !== undefined ? accessor(file, given[name], false) : null;
        const t = get('TRANSLATION'), r = get('ROTATION'), s = get('SCALE'), any = t || r || s;
        return Array.from({length: any ? any.count : 0}, (_, i) => {
            const place = new THREE.Matrix4().compose(
                t ? new THREE.Vector3().fromArray(t.array, 3 * i) : new THREE.Vector3(),
                r ? new THREE.Quaternion().fromArray(r.array, 4 * i) : new THREE.Quaternion(),
                s ? new THREE.Vector3().fromArray(s.array, 3 * i) : new THREE.Vector3(1, 1, 1));
            return world.clone().multiply(place);
        });
    }

    /* The UV set of lightmaps: the one asked for, the lightmap's, AO's if it has its own, or the one that `bake` chooses. */
    function lightSet(material, arrays, asked) {
        const has = set => set < UV_SETS && arrays.uvs[set] !== null;
        if (asked >= 0) {
            return has(asked) ? asked : -1;
        }
        for (const map of [material.light, material.ao && material.ao.set > 0 ? material.ao : null,
            material.unlit && material.base && material.base.set > 0 ? material.base : null]) {
            if (map && has(map.set)) {
                return map.set;
            }
        }
        return has(1) ? 1 : has(0) ? 0 : -1;
    }

    /* UVs of a set with the texture's transform, if it has one. */
    VIEW.movedUvs = function (arrays, set, matrix) {
        const key = [set, ...matrix.elements].join(), uvs = arrays.uvs[set];
        if (!uvs || matrix.equals(new THREE.Matrix3())) {
            return uvs || null;
        }
        if (!arrays.moved.has(key)) {
            const point = new THREE.Vector2(), moved = new Float32Array(uvs.length);
            for (let i = 0; i < uvs.length; i += 2) {
                point.fromArray(uvs, i).applyMatrix3(matrix).toArray(moved, i);
            }
            arrays.moved.set(key, moved);
        }
        return arrays.moved.get(key);
    };

    /* UVs of the lightmap, with its own transform or the one of packed integers. */
    function lightUvs(material, arrays, set) {
        const maps = arrays.integers[set] ? [material.light, ...material.layouts] : [material.light];
        const map = maps.find(one => one && one.set === set);
        return VIEW.movedUvs(arrays, set, map ? map.matrix : new THREE.Matrix3());
    }

    /* Leaves out a primitive that cannot be read, with an entry in file.problems. */
    function tryArrays(file, primitive, weights, name) {
        try {
            return arraysOf(file, primitive, weights);
        } catch (error) {
            file.problems.add(name + ' is not shown: ' + error.message);
            return null;
        }
    }

    VIEW.loadScene = async function (bytes, named, uvSet, tell) {
        const file = openFile(bytes, named), json = file.json, worlds = placeNodes(file);
        const materials = new Map(), known = new Map(), drawn = [];
        for (let index = 0; index < worlds.length; ++index) {
            const node = worlds[index] ? json.nodes[index] : {};
            if (node.mesh === undefined) {
                continue;
            }
            const mesh = at(json.meshes, node.mesh, 'mesh');
            const name = node.name || mesh.name || 'mesh ' + node.mesh;
            tell(name);
            for (const primitive of mesh.primitives || []) {
                if (!materials.has(primitive.material)) {
                    materials.set(primitive.material, await materialOf(file, primitive.material));
                }
                const weights = node.weights || mesh.weights;
                if (!known.has(primitive) || weights || node.skin !== undefined) {
                    known.set(primitive, tryArrays(file, primitive, weights, name));
                }
                let arrays = known.get(primitive), world = worlds[index];
                if (arrays === null || arrays.indices.length === 0) {
                    continue;
                }
                if (node.skin !== undefined && arrays.joints && arrays.weights) {
                    arrays = pose(file, arrays, at(json.skins, node.skin, 'skin'), worlds);
                    world = new THREE.Matrix4();
                }
                const material = materials.get(primitive.material);
                for (const matrix of placesOf(file, node, world)) {
                    const set = lightSet(material, arrays, uvSet);
                    drawn.push({name, material, arrays, matrix, set, uvs: lightUvs(material, arrays, set)});
                }
            }
        }
        if (drawn.length === 0) {
            throw new Error('it has no triangles');
        }
        return {drawn, problems: file.problems};
    };
})();
