/* Materials and textures of a glTF file, as far as they are shown. */
'use strict';

(function () {
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

    /* {texture, image, index, set, matrix} of a texture info; null where there is none to be had. */
    async function texture(file, info, mipmaps) {
        if (!info || info.index === undefined) {
            return null;
        }
        const definition = VIEW.gltf.at(file.json.textures, info.index, 'texture');
        const source = imageOf(file, info.index, definition);
        const bitmap = source !== undefined ? await VIEW.gltf.image(file, source) : null;
        if (bitmap === null) {
            return null;
        }
        const sampler = definition.sampler !== undefined
            ? VIEW.gltf.at(file.json.samplers, definition.sampler, 'sampler') : {};
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

    VIEW.material = async function (file, index) {
        const m = index !== undefined ? VIEW.gltf.at(file.json.materials, index, 'material') : {};
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
    };
})();
