/* The nodes of a glTF file as things to draw: {mesh, material, arrays, matrix}, skins and morphs at rest, as vdbshade
 * bakes them. */
'use strict';

(function () {
    const MOST_DEPTH = 1024, UV_SETS = 8, TRIANGLES = 4, STRIP = 5, FAN = 6, FLOAT = 5126;

    function indicesOf(file, primitive, count) {
        const given = primitive.indices !== undefined
            ? VIEW.gltf.accessor(file, primitive.indices, true).array : Uint32Array.from({length: count}, (_, i) => i);
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
        const get = name => attributes[name] !== undefined ? VIEW.gltf.accessor(file, attributes[name], false) : null;
        const moved = name => {
            const given = get(name), targets = primitive.targets || [];
            if (!given || !weights || !targets.some((target, i) => target[name] !== undefined && weights[i])) {
                return given;
            }
            const array = given.array.slice();
            targets.forEach((target, i) => {
                if (target[name] !== undefined && weights[i]) {
                    const more = VIEW.gltf.accessor(file, target[name], false).array;
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

    /* Positions and normals in the world, by the joints as they stand. */
    function pose(file, arrays, skin, worlds) {
        const bind = skin.inverseBindMatrices !== undefined
            ? VIEW.gltf.accessor(file, skin.inverseBindMatrices, false).array : null;
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
        const roots = json.scenes ? VIEW.gltf.at(json.scenes, json.scene || 0, 'scene').nodes || [] : [];
        const visit = (index, parent, depth) => {
            const node = VIEW.gltf.at(json.nodes, index, 'node');
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

    /* Where the copies of a node stand (EXT_mesh_gpu_instancing), or the node itself. */
    function placesOf(file, node, world) {
        const given = ((node.extensions || {}).EXT_mesh_gpu_instancing || {}).attributes;
        if (!given) {
            return [world];
        }
        const get = name => given[name] !== undefined ? VIEW.gltf.accessor(file, given[name], false) : null;
        const t = get('TRANSLATION'), r = get('ROTATION'), s = get('SCALE'), any = t || r || s;
        return Array.from({length: any ? any.count : 0}, (_, i) => {
            const place = new THREE.Matrix4().compose(
                t ? new THREE.Vector3().fromArray(t.array, 3 * i) : new THREE.Vector3(),
                r ? new THREE.Quaternion().fromArray(r.array, 4 * i) : new THREE.Quaternion(),
                s ? new THREE.Vector3().fromArray(s.array, 3 * i) : new THREE.Vector3(1, 1, 1));
            return world.clone().multiply(place);
        });
    }

    /* The UV set that lightmaps have: that of the lightmap, of AO where that has one of its own, or what `bake` takes. */
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

    /* UVs of the lightmap, with its own transform or the one for a packer's integers. */
    function lightUvs(material, arrays, set) {
        const maps = arrays.integers[set] ? [material.light, ...material.layouts] : [material.light];
        const map = maps.find(one => one && one.set === set);
        return VIEW.movedUvs(arrays, set, map ? map.matrix : new THREE.Matrix3());
    }

    /* A primitive that cannot be had is left out, with a word about it. */
    function tryArrays(file, primitive, weights, name) {
        try {
            return arraysOf(file, primitive, weights);
        } catch (error) {
            file.problems.add(name + ' is not shown: ' + error.message);
            return null;
        }
    }

    VIEW.loadScene = async function (bytes, named, uvSet, tell) {
        const file = VIEW.gltf.open(bytes, named), json = file.json, worlds = placeNodes(file);
        const materials = new Map(), known = new Map(), drawn = [];
        for (let index = 0; index < worlds.length; ++index) {
            const node = worlds[index] ? json.nodes[index] : {};
            if (node.mesh === undefined) {
                continue;
            }
            const mesh = VIEW.gltf.at(json.meshes, node.mesh, 'mesh');
            const name = node.name || mesh.name || 'mesh ' + node.mesh;
            tell(name);
            for (const primitive of mesh.primitives || []) {
                if (!materials.has(primitive.material)) {
                    materials.set(primitive.material, await VIEW.material(file, primitive.material));
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
                    arrays = pose(file, arrays, VIEW.gltf.at(json.skins, node.skin, 'skin'), worlds);
                    world = new THREE.Matrix4();
                }
                const material = materials.get(primitive.material);
                for (const matrix of placesOf(file, node, world)) {
                    const set = lightSet(material, arrays, uvSet);
                    drawn.push({name, mesh: mesh.name || '', material, arrays, matrix, set,
                        uvs: lightUvs(material, arrays, set)});
                }
            }
        }
        if (drawn.length === 0) {
            throw new Error('it has no triangles');
        }
        return {drawn, materials: [...materials.values()], problems: file.problems};
    };
})();
