/* What the page carries, as bytes and numbers: base64, deflate, halves, the planes of a bake. */
'use strict';

const VIEW = {};

(function () {
    /* Of base64 characters that are decoded at a time: a multiple of four. */
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
        element.remove(); /* half of the memory that it takes */
        return bytes;
    };

    VIEW.inflate = async function (bytes) {
        if (typeof DecompressionStream === 'undefined') {
            throw new Error('this browser is too old for the planes of a bake (it has no DecompressionStream)');
        }
        const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
        return new Uint8Array(await new Response(stream).arrayBuffer());
    };

    /* A plane of halves: all high bytes, then all low ones, each less its left neighbour (src/view/planes.c). */
    VIEW.plane = async function (id, width, height) {
        const texels = width * height, bytes = await VIEW.inflate(VIEW.block(id));
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
    };

    /* IEEE 754 binary16 to a number, by a table of all of them. */
    let numbers = null;
    VIEW.halves = function () {
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
    };

    /* The half nearest to a finite number of 0 … 65504, as bits. */
    VIEW.half = function (value) {
        if (!(value > 0)) {
            return 0;
        }
        const exponent = Math.max(Math.floor(Math.log2(value)), -14);
        const bits = (exponent + 14) * 1024 + Math.round(value * 2 ** (10 - exponent));
        return Math.min(bits, 31743);
    };

    /* --- the planes of a page of a bake */

    const byName = (page, name) => page.channels.find(channel => channel.name === name);

    /* Channels as they are shown: values of one component, or of three by their last letter. */
    VIEW.groups = function (page) {
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
    };

    /* What a page shows as light, as EXR's picture (docs/formats.md): the irradiance, or the mean of the shadows
     * times AO, or R, G and B of a file without names. */
    VIEW.picture = function (page) {
        const groups = VIEW.groups(page);
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
            const number = VIEW.halves(), values = new Uint16Array(page.width * page.height);
            for (let i = 0; i < values.length; ++i) {
                let sum = 0;
                for (const shadow of shadows) {
                    sum += number[shadow.channels[0].values[i]];
                }
                const light = shadows.length > 0 ? sum / shadows.length : 1;
                values[i] = VIEW.half(ao ? light * number[ao.channels[0].values[i]] : light);
            }
            page.mean = {name: 'picture', values};
        }
        return {name: 'shadow × ao', channels: [page.mean, page.mean, page.mean]};
    };

    VIEW.group = function (page, name) {
        return VIEW.groups(page).find(group => group.name === name) || null;
    };

    VIEW.loadPlanes = async function (bakes, tell) {
        for (const bake of bakes) {
            for (const page of bake.pages) {
                for (const channel of page.channels) {
                    tell(page.name + ': ' + channel.name);
                    channel.values = await VIEW.plane(channel.data, page.width, page.height);
                }
            }
        }
    };
})();
