/* The texel under a point of the view, and every value that is known of it. */
'use strict';

(function () {
    const raycaster = new THREE.Raycaster();

    /* A texel's coordinate within 0 … count - 1, as repeated lookups have it. */
    const wrap = (x, count) => ((Math.floor(x) % count) + count) % count;

    /* What of a bake lies at (x, y) of normalized device coordinates; null: nothing. */
    VIEW.pick = function (bake, camera, x, y) {
        camera.updateMatrixWorld();
        raycaster.setFromCamera({x, y}, camera);
        const hit = raycaster.intersectObjects(bake.meshes, false)[0];
        if (!hit) {
            return null;
        }
        const {drawn, page, size, chart} = hit.object.userData, vertices = [hit.face.a, hit.face.b, hit.face.c];
        const found = {bake, object: hit.object, drawn, page, size, point: hit.point, triangle: hit.faceIndex,
            distance: hit.distance, chart: chart ? chart[vertices[0]] : null, uv: null, texel: null, weights: null, vertices};
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

    const uvAt = (found, set) => {
        if (set === found.drawn.set) {
            return found.uv;
        }
        return null;
    };

    /* [[name, text]] of what a picked texel holds. */
    VIEW.values = function (found) {
        const list = [], number = VIEW.halves(), {material} = found.drawn;
        const text = value => Number.isFinite(value) ? String(+value.toPrecision(4)) : String(value);
        if (found.page && (found.texel || found.bake.perVertex)) {
            const at = found.texel ? [found.texel[1] * found.page.width + found.texel[0]] : found.vertices;
            const weights = found.texel ? [1] : found.weights;
            const mean = channel => at.reduce((sum, place, k) => sum + weights[k] * number[channel.values[place]], 0);
            for (const group of VIEW.groups(found.page)) {
                const values = [...new Set(group.channels)].map(channel => text(mean(channel)));
                list.push([group.name, values.join('  ')]);
            }
        }
        for (const [name, map] of [['lightmap', material.light], ['occlusion', material.ao]]) {
            const uv = map ? uvAt(found, map.set) : null;
            if (uv) {
                const rgb = [...pixel(map.image, uv[0], uv[1])].slice(0, 3);
                list.push([name + ' / 255', name === 'occlusion' ? String(rgb[0]) : rgb.join('  ')]);
            }
        }
        return list;
    };
})();
