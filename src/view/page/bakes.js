/* A bake as things of three.js: a scene of meshes that share arrays, each with a material that a mode sets. */
'use strict';

(function () {
    const ASSUMED = 1024; /* texels a side, where no lightmap says how many there are */
    const ONE = 0x3c00;   /* 1 as a half */

    /* Which lightmap a thing has its texels in: the images in their order, or pages in theirs. */
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

    /* Puts meshes into bake.scene. `loaded` is what VIEW.loadScene() gave; bakes of one file share it. */
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

    /* Charts and density are looked for when they are first asked for. */
    VIEW.needCharts = function (bake) {
        if (bake.charts !== undefined) {
            return;
        }
        bake.charts = 0;
        for (const mesh of bake.meshes) {
            const {drawn} = mesh.userData;
            if (drawn.set >= 0) {
                const found = VIEW.chartsOf(drawn, bake.charts);
                mesh.geometry = withAttribute(mesh.geometry, 'chart', new THREE.BufferAttribute(found.colors, 3));
                mesh.userData.chart = found.chart;
                bake.charts += found.count;
            }
        }
    };

    VIEW.needDensity = function (bake) {
        if (bake.density !== undefined) {
            return;
        }
        let world = 0, texels = 0;
        for (const mesh of bake.meshes) {
            if (mesh.userData.drawn.set >= 0) {
                const areas = VIEW.areasOf(mesh.userData.drawn, mesh.userData.size);
                world += areas.world;
                texels += areas.texels;
            }
        }
        bake.density = world > 0 ? Math.sqrt(texels / world) : 0;
    };

    /* What the planes of a page have for a mode; null: nothing. */
    function groupFor(page, mode, channel) {
        if (mode === 'lit') {
            return VIEW.picture(page);
        }
        if (mode === 'ao' || mode === 'bent') {
            return VIEW.group(page, mode);
        }
        if (mode === 'light') {
            return VIEW.group(page, channel);
        }
        if (mode === 'invalid') {
            const invalid = page.channels.find(c => c.name === 'invalid'), a = page.channels.find(c => c.name === 'A');
            return invalid || a ? {name: 'invalid and A', channels: [invalid, a, null], missing: [0, ONE, 0]} : null;
        }
        return null;
    }

    /* The names of what a bake has for `light`, its lights first. */
    VIEW.lightsOf = function (bake) {
        const names = bake.pages.length > 0 ? VIEW.groups(bake.pages[0]).map(group => group.name) : [];
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
            VIEW.needCharts(bake);
        }
        if (state.mode === 'density') {
            VIEW.needDensity(bake);
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
})();
