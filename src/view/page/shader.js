/* One shader for everything. Planes are linear; a mode's result is sRGB only if it is light. */
'use strict';

(function () {
    /* Modes: name, label, hint. */
    VIEW.MODES = [
        ['lit', 'Lit', 'base colour times light'], ['ao', 'Ambient occlusion', '1 open, 0 closed'],
        ['light', 'Light', 'one light or channel'], ['bent', 'Bent normals', 'colours of (1 + n) / 2'],
        ['checker', 'UV checker', 'squares of 8 × 8 texels'], ['density', 'Texel density', 'texels a unit'],
        ['invalid', 'Invalid texels', 'inside solids, behind walls'], ['charts', 'Charts', 'a colour each'],
        ['base', 'Base colour', 'without light']
    ];
    VIEW.MODE = Object.fromEntries(VIEW.MODES.map(([name], number) => [name, number]));

    /* A quarter of the mean density, half of it, the mean, twice, four times. */
    VIEW.DENSITY = [[33, 79, 191], [92, 171, 222], [224, 224, 217], [245, 166, 69], [204, 41, 38]];
    const DENSITY = VIEW.DENSITY.map(rgb => 'vec3(' + rgb.map(value => (value / 255).toFixed(5)).join() + ')');

    /* Lookups use centroids: a pixel's middle may lie outside of the triangle, where other charts are. vPlace, for
     * derivatives, uses the middle. */
    const VARYINGS = `
centroid varying vec2 vLight, vBase, vAo, vGlow;
varying vec2 vPlace;
varying vec3 vTint, vChart, vNormalView, vView, vWorld;
varying vec4 vValue;`;

    const vertex = `
attribute vec2 uvLight, uvBase, uvAo, uvGlow;
attribute vec3 tint, chart;
${VARYINGS}
uniform mat3 baseMatrix, glowMatrix;
uniform bool perVertex;
uniform sampler2D plane;
void main() {
    int row = textureSize(plane, 0).x; /* a vertex has the texel of its number */
    vValue = perVertex ? texelFetch(plane, ivec2(gl_VertexID % row, gl_VertexID / row), 0) : vec4(0.0);
    vec4 view = modelViewMatrix * vec4(position, 1.0);
    vLight = uvLight;
    vPlace = uvLight;
    vAo = uvAo;
    vBase = (baseMatrix * vec3(uvBase, 1.0)).xy;
    vGlow = (glowMatrix * vec3(uvGlow, 1.0)).xy;
    vTint = tint;
    vChart = chart;
    vNormalView = normalMatrix * normal;
    vView = view.xyz;
    vWorld = (modelMatrix * vec4(position, 1.0)).xyz;
    gl_Position = projectionMatrix * view;
}`;

    const fragment = `
uniform int mode;
uniform bool hasPlane, hasLight, hasAo, hasBase, hasGlow, hasTint, hasUv, unlit, encode, perVertex;
uniform sampler2D plane, lightMap, aoMap, baseMap, glowMap;
uniform vec4 color;
uniform vec3 glow;
uniform float intensity, strength, cutoff, gain, reference;
uniform vec2 size, picked;
${VARYINGS}

vec3 toLinear(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), vec3(greaterThan(c, vec3(0.04045))));
}
vec3 toSrgb(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, vec3(greaterThan(c, vec3(0.0031308))));
}
vec3 ramp(float x) { /* 0 ... 1: too few, as in the mean, too many */
    vec3 few = mix(${DENSITY[0]}, ${DENSITY[1]}, clamp(4.0 * x, 0.0, 1.0));
    few = mix(few, ${DENSITY[2]}, clamp(4.0 * x - 1.0, 0.0, 1.0));
    few = mix(few, ${DENSITY[3]}, clamp(4.0 * x - 2.0, 0.0, 1.0));
    return mix(few, ${DENSITY[4]}, clamp(4.0 * x - 3.0, 0.0, 1.0));
}
vec3 grey(float x) { return vec3(x); }
/* Light from a white surface: the lightmap is linear irradiance, as in three.js and Hubs. */
vec3 baked() { return texture2D(lightMap, vLight).rgb * intensity / 3.14159265358979; }
/* Shading of surfaces without light. */
float shape() {
    vec3 n = normalize(dot(vNormalView, vNormalView) > 0.0 ? vNormalView : cross(dFdx(vView), dFdy(vView)));
    return 0.55 + 0.45 * abs(dot(n, normalize(vView)));
}
void main() {
    vec4 base = color;
    if (hasBase) {
        vec4 texel = texture2D(baseMap, vBase);
        base *= vec4(toLinear(texel.rgb), texel.a);
    }
    if (hasTint) { base.rgb *= vTint; }
    if (base.a < cutoff) { discard; }
    vec3 plain = base.rgb * (unlit ? 1.0 : shape());
    vec3 emitted = glow * (hasGlow ? toLinear(texture2D(glowMap, vGlow).rgb) : vec3(1.0));
    float ao = hasAo ? mix(1.0, texture2D(aoMap, vAo).r, strength) : 1.0;
    bool known = hasPlane && (hasUv || perVertex);
    vec4 value = perVertex ? vValue : known ? texture2D(plane, vLight) : vec4(0.0);
    vec3 none = vec3(0.18, 0.18, 0.2) * shape();
    vec3 shown = none;
    if (mode == ${VIEW.MODE.lit}) {
        if (known) { shown = base.rgb * value.rgb * gain + emitted; }
        else if (hasLight) { shown = base.rgb * baked() * ao * gain + emitted; }
        else { shown = plain * ao * gain + emitted; }
        shown = toSrgb(shown);
    } else if (mode == ${VIEW.MODE.base}) {
        shown = toSrgb(base.rgb + emitted);
    } else if (mode == ${VIEW.MODE.ao}) {
        if (known) { shown = value.rgb; }
        else if (hasAo) { shown = grey(texture2D(aoMap, vAo).r); }
    } else if (mode == ${VIEW.MODE.light}) {
        if (known) { shown = encode ? toSrgb(value.rgb * gain) : value.rgb * gain; }
        else if (hasLight) { shown = toSrgb(baked() * gain); }
    } else if (mode == ${VIEW.MODE.bent}) {
        if (known) { shown = 0.5 + 0.5 * value.rgb; }
    } else if (mode == ${VIEW.MODE.invalid}) {
        if (known) {
            shown = value.r > 0.5 ? vec3(0.93, 0.1, 0.6) : value.g < 0.5 ? vec3(0.95, 0.65, 0.15) : vec3(0.62) * shape();
        }
    } else if (mode == ${VIEW.MODE.charts}) {
        if (hasUv) { shown = vChart * shape(); }
    } else if (mode == ${VIEW.MODE.checker}) {
        if (hasUv) {
            vec2 cell = floor(vLight * size / 8.0);
            float odd = mod(cell.x + cell.y, 2.0), coarse = mod(floor(cell.x / 8.0) + floor(cell.y / 8.0), 2.0);
            vec3 hue = vec3(0.35 + 0.6 * vLight.x, 0.35 + 0.6 * vLight.y, 0.9 - 0.35 * (vLight.x + vLight.y));
            shown = mix(hue * 0.45, hue, odd) * mix(0.8, 1.0, coarse) * shape();
        }
    } else if (mode == ${VIEW.MODE.density}) {
        vec2 a = dFdx(vPlace) * size, b = dFdy(vPlace) * size;
        float texels = abs(a.x * b.y - a.y * b.x), area = length(cross(dFdx(vWorld), dFdy(vWorld)));
        if (hasUv && texels > 0.0 && area > 0.0) {
            shown = ramp(clamp(0.5 + 0.25 * log2(sqrt(texels / area) / reference), 0.0, 1.0)) * shape();
        }
    }
    if (picked.x >= 0.0 && hasUv && all(equal(floor(vLight * size), picked))) {
        vec2 side = abs(fract(vLight * size) - 0.5);
        if (max(side.x, side.y) > 0.36) { shown = vec3(1.0, 0.35, 0.1); }
    }
    gl_FragColor = vec4(shown, mode == ${VIEW.MODE.lit} || mode == ${VIEW.MODE.base} ? base.a : 1.0);
}`;

    const empty = new THREE.DataTexture(new Uint8Array(4), 1, 1);

    /* A material of three.js for one of glTF's, with lightmaps of `size` texels, or a value each vertex. */
    VIEW.shaderOf = function (material, hasTint, hasUv, size, perVertex) {
        const textureOf = map => map ? map.texture : empty;
        const uniforms = {
            mode: {value: 0}, hasPlane: {value: false}, plane: {value: empty}, encode: {value: false},
            hasLight: {value: material.light !== null}, lightMap: {value: textureOf(material.light)},
            hasAo: {value: material.ao !== null}, aoMap: {value: textureOf(material.ao)},
            hasBase: {value: material.base !== null}, baseMap: {value: textureOf(material.base)},
            hasGlow: {value: material.glow !== null}, glowMap: {value: textureOf(material.glow)},
            baseMatrix: {value: material.base ? material.base.matrix : new THREE.Matrix3()},
            glowMatrix: {value: material.glow ? material.glow.matrix : new THREE.Matrix3()},
            hasTint: {value: hasTint}, hasUv: {value: hasUv}, perVertex: {value: perVertex}, unlit: {value: material.unlit},
            color: {value: new THREE.Vector4().fromArray(material.color)},
            glow: {value: new THREE.Vector3().fromArray(material.emissive)},
            intensity: {value: material.intensity}, strength: {value: material.strength},
            cutoff: {value: material.cutoff}, gain: {value: 1}, reference: {value: 1},
            size: {value: new THREE.Vector2(size[0], size[1])}, picked: {value: new THREE.Vector2(-1, -1)}
        };
        const made = new THREE.ShaderMaterial({uniforms, vertexShader: vertex, fragmentShader: fragment,
            side: material.doubleSided || perVertex ? THREE.DoubleSide : THREE.FrontSide});
        made.userData.blended = material.alphaMode === 'BLEND';
        made.userData.side = made.side;
        made.extensions.derivatives = true;
        return made;
    };

    /* Planes of a group as a texture, in a cache of the last ones. */
    const kept = [], MOST_KEPT = 6;
    VIEW.planeTexture = function (page, group) {
        const found = kept.find(entry => entry.page === page && entry.name === group.name);
        if (found) {
            return found.texture;
        }
        const count = page.width * page.height, data = new Uint16Array(4 * count);
        for (let i = 0; i < count; ++i) {
            for (let c = 0; c < 3; ++c) {
                const channel = group.channels[c];
                data[4 * i + c] = channel ? channel.values[i] : (group.missing || [0, 0, 0])[c];
            }
        }
        const texture = new THREE.DataTexture(data, page.width, page.height, THREE.RGBAFormat, THREE.HalfFloatType);
        texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
        texture.needsUpdate = true;
        kept.push({page, name: group.name, texture});
        if (kept.length > MOST_KEPT) {
            kept.shift().texture.dispose();
        }
        return texture;
    };
})();
