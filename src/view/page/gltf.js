/* glTF 2.0: the arrays and images of a file. The loader of three.js r111 knows two UV sets and no MOZ_lightmap; this one
 * reads all eight. The file has passed vdbshade's own reader, but what that does not look at may be anything. */
'use strict';

(function () {
    /* Type, and what a normalized 1 is stored as. */
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

    /* `named`: the bytes of the files that it names, by their URIs. */
    function open(bytes, named) {
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

    /* Puts the elements that a sparse accessor names in the place of those that are there. */
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

    /* A decoded image, its pixels as they are stored; null, with a word about it, where it cannot be had. */
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

    VIEW.gltf = {open, at, accessor, image};
})();
