/* What stands over the view: modes, lights, sliders, what was picked. All texts of files go in as text. */
'use strict';

(function () {
    VIEW.MODES = [
        ['lit', 'Lit', 'base colour times light'], ['ao', 'Ambient occlusion', '1 open, 0 closed'],
        ['light', 'Light', 'one light or channel'], ['bent', 'Bent normals', 'colours of (1 + n) / 2'],
        ['checker', 'UV checker', 'squares of 8 × 8 texels'], ['density', 'Texel density', 'texels a unit'],
        ['invalid', 'Invalid texels', 'inside solids, behind walls'], ['charts', 'Charts', 'a colour each'],
        ['base', 'Base colour', 'without light']
    ];

    const byId = id => document.getElementById(id);

    VIEW.element = function (name, text, className) {
        const made = document.createElement(name);
        if (text !== undefined) {
            made.textContent = text;
        }
        if (className) {
            made.className = className;
        }
        return made;
    };

    /* Buttons of the modes. */
    VIEW.makeModes = function (choose) {
        VIEW.MODES.forEach(([mode, name], i) => {
            const button = VIEW.element('button', name), key = VIEW.element('kbd', String(i + 1));
            button.type = 'button';
            button.dataset.mode = mode;
            button.setAttribute('role', 'radio');
            button.prepend(key);
            button.onclick = () => choose(mode);
            byId('modes').append(button);
        });
    };

    /* Disables the modes that no bake has. */
    function tellModes(state, bakes) {
        VIEW.MODES.forEach(([mode, , what], i) => {
            const button = byId('modes').children[i], there = bakes.some(bake => VIEW.has(bake, mode));
            button.disabled = !there;
            button.title = there ? what : 'nothing of it is in the files';
            button.setAttribute('aria-checked', String(mode === state.mode));
            button.tabIndex = mode === state.mode ? 0 : -1;
        });
    }

    function tellLights(state, bakes) {
        const names = [...new Set(bakes.flatMap(bake => VIEW.lightsOf(bake)))], select = byId('channel');
        if ([...select.options].map(option => option.value).join('\n') !== names.join('\n')) {
            select.replaceChildren(...names.map(name => VIEW.element('option', name)));
        }
        select.value = state.channel;
    }

    function tellSides(state, bakes) {
        document.title = bakes.map(bake => bake.name).join(' | ');
        byId('names').textContent = bakes.map(bake => bake.name).join('  |  ');
        byId('compare').hidden = bakes.length < 2;
        byId('split').value = state.split;
        byId('bar').style.left = 100 * state.split + '%';
        ['left', 'right'].forEach((side, i) => {
            byId(side).textContent = byId(side).title = bakes[i] ? bakes[i].name : '';
        });
    }

    function legend(state, bake) {
        const box = byId('legend');
        box.textContent = '';
        const entry = (color, text) => {
            const swatch = VIEW.element('i');
            swatch.style.background = color;
            const line = VIEW.element('span');
            line.append(swatch, text);
            box.append(line);
        };
        if (state.mode === 'density') {
            VIEW.DENSITY.forEach((rgb, i) => entry('rgb(' + rgb + ')',
                (i === 0 ? '≤ ' : i === 4 ? '≥ ' : '') + +(bake.density * 2 ** (i - 2)).toPrecision(3)));
            box.append(VIEW.element('span', 'texels a unit'));
        } else if (state.mode === 'invalid') {
            entry('rgb(237,26,153)', 'invalid: inside a solid or behind a wall');
            entry('rgb(242,166,38)', 'no sample: filled from neighbours');
            entry('rgb(158,158,158)', 'valid');
        } else if (state.mode === 'charts') {
            box.append(VIEW.element('span', bake.charts + (bake.charts === 1 ? ' chart' : ' charts')));
        }
        box.hidden = box.childNodes.length === 0;
    }

    /* The panels as the state has them. */
    VIEW.tell = function (state, bakes) {
        tellModes(state, bakes);
        tellLights(state, bakes);
        tellSides(state, bakes);
        byId('lights').hidden = state.mode !== 'light';
        byId('exposure').value = state.exposure;
        byId('exposure-value').textContent = (state.exposure > 0 ? '+' : '') + state.exposure.toFixed(1) + ' EV';
        byId('texels').checked = state.texels;
        byId('wireframe').checked = state.wireframe;
        byId('sides').checked = state.sides;
        document.documentElement.dataset.theme = state.theme;
        document.body.classList.toggle('bare', !state.ui);
        legend(state, bakes[0]);
    };

    /* What was picked: a column a bake. */
    VIEW.tellPicked = function (picked) {
        const box = byId('picked');
        box.textContent = '';
        box.hidden = picked.length === 0;
        for (const found of picked) {
            const {drawn} = found, table = VIEW.element('table'), rows = [];
            const three = value => +value.toFixed(3);
            const close = VIEW.element('h2', drawn.name);
            rows.push(['bake', found.bake.name], ['material', drawn.material.name], ['triangle', String(found.triangle)],
                ['position', [found.point.x, found.point.y, found.point.z].map(three).join('  ')]);
            if (found.texel) {
                rows.push(['UV set', String(drawn.set)], ['UV', found.uv.map(value => value.toFixed(5)).join('  ')],
                    ['texel', found.texel.join('  ') + ' of ' + found.size.join(' × ')]);
            } else {
                rows.push(['UV set', 'none']);
            }
            if (found.chart !== null) {
                rows.push(['chart', String(found.chart)]);
            }
            for (const [name, text] of [...rows, ...VIEW.values(found)].filter(row => row[1] !== '')) {
                const row = table.insertRow();
                row.append(VIEW.element('th', name), VIEW.element('td', text));
            }
            box.append(close, table);
        }
    };

    VIEW.message = function (text, wrong) {
        const box = byId('message');
        box.textContent = text;
        box.hidden = text === '';
        box.classList.toggle('wrong', wrong === true);
    };

    VIEW.problems = function (list) {
        byId('problems').hidden = list.length === 0;
        byId('problems').textContent = list.join('\n');
    };
})();
