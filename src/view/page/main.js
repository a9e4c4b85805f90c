/* The view: loads what the page carries, draws it after a change, and handles all input. Texts of files are only shown as
 * text. */
'use strict';

(function () {
    const byId = id => document.getElementById(id);
    const state = {mode: 'lit', channel: null, exposure: 0, split: 0.5, texels: false, wireframe: false, sides: false,
        theme: matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark', ui: true, picks: null};
    let renderer, camera, controls, bakes = [], box = null, due = false;

    /* --- panels: modes, lights, sliders, the picked texel */

    function element(name, text = '') {
        const made = document.createElement(name);
        made.textContent = text;
        return made;
    }

    function makeModes() {
        VIEW.MODES.forEach(([mode, name], i) => {
            const button = element('button', name);
            button.type = 'button';
            button.dataset.mode = mode;
            button.setAttribute('role', 'radio');
            button.prepend(element('kbd', String(i + 1)));
            button.onclick = () => set({mode});
            byId('modes').append(button);
        });
    }

    /* Disables the modes that no bake has. */
    function showModes() {
        VIEW.MODES.forEach(([mode, , hint], i) => {
            const button = byId('modes').children[i], there = bakes.some(bake => VIEW.has(bake, mode));
            button.disabled = !there;
            button.title = there ? hint : 'nothing of it is in the files';
            button.setAttribute('aria-checked', String(mode === state.mode));
            button.tabIndex = mode === state.mode ? 0 : -1;
        });
    }

    function showLights(lights) {
        const names = [...new Set(lights)], select = byId('channel');
        if ([...select.options].map(option => option.value).join('\n') !== names.join('\n')) {
            select.replaceChildren(...names.map(name => element('option', name)));
        }
        select.value = state.channel;
    }

    function showSides() {
        document.title = bakes.map(bake => bake.name).join(' | ');
        byId('names').textContent = bakes.map(bake => bake.name).join('  |  ');
        byId('compare').hidden = bakes.length < 2;
        byId('split').value = state.split;
        byId('bar').style.left = 100 * state.split + '%';
        ['left', 'right'].forEach((side, i) => {
            byId(side).textContent = byId(side).title = bakes[i] ? bakes[i].name : '';
        });
    }

    function showLegend(bake) {
        const box = byId('legend');
        box.textContent = '';
        const entry = (color, text) => {
            const swatch = element('i');
            swatch.style.background = color;
            const line = element('span');
            line.append(swatch, text);
            box.append(line);
        };
        if (state.mode === 'density') {
            VIEW.DENSITY.forEach((rgb, i) => entry('rgb(' + rgb + ')',
                (i === 0 ? '≤ ' : i === 4 ? '≥ ' : '') + +(bake.density * 2 ** (i - 2)).toPrecision(3)));
            box.append(element('span', 'texels a unit'));
        } else if (state.mode === 'invalid') {
            entry('rgb(237,26,153)', 'invalid: inside a solid or behind a wall');
            entry('rgb(242,166,38)', 'no sample: filled from neighbours');
            entry('rgb(158,158,158)', 'valid');
        } else if (state.mode === 'charts') {
            box.append(element('span', bake.charts + (bake.charts === 1 ? ' chart' : ' charts')));
        }
        box.hidden = box.childNodes.length === 0;
    }

    /* Shows the state in the panels. */
    function showState(lights) {
        showModes();
        showLights(lights);
        showSides();
        byId('lights').hidden = state.mode !== 'light';
        byId('exposure').value = state.exposure;
        byId('exposure-value').textContent = (state.exposure > 0 ? '+' : '') + state.exposure.toFixed(1) + ' EV';
        ['texels', 'wireframe', 'sides'].forEach(name => { byId(name).checked = state[name]; });
        document.documentElement.dataset.theme = state.theme;
        document.body.classList.toggle('bare', !state.ui);
        showLegend(bakes[0]);
    }

    /* Shows the picked texels, a table for each bake. */
    function showPicked(picked) {
        const box = byId('picked');
        box.textContent = '';
        box.hidden = picked.length === 0;
        for (const found of picked) {
            const {drawn} = found, table = element('table'), rows = [];
            const three = value => +value.toFixed(3);
            const close = element('h2', drawn.name);
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
                row.append(element('th', name), element('td', text));
            }
            box.append(close, table);
        }
    }

    function message(text, wrong) {
        const box = byId('message');
        box.textContent = text;
        box.hidden = text === '';
        box.classList.toggle('wrong', wrong === true);
    }

    function showProblems(list) {
        byId('problems').hidden = list.length === 0;
        byId('problems').textContent = list.join('\n');
    }

    /* --- the address, which stores a view: #mode=ao&camera=X,Y,Z,X,Y,Z */

    const readers = {
        mode: text => VIEW.MODES.some(mode => mode[0] === text) ? text : 'lit', channel: text => text,
        exposure: text => Math.min(Math.max(+text || 0, -8), 8),
        split: text => Math.min(Math.max(+text || 0, 0), 1), texels: text => text === '1',
        wireframe: text => text === '1', sides: text => text === '1', ui: text => text !== '0',
        theme: text => text === 'light' ? 'light' : 'dark'
    };

    const numbersOf = text => (text || '').split(',').map(Number).filter(Number.isFinite);

    function readAddress() {
        const given = new URLSearchParams(location.hash.slice(1));
        for (const [key, read] of Object.entries(readers)) {
            if (given.has(key)) {
                state[key] = read(given.get(key));
            }
        }
        const stands = numbersOf(given.get('camera')), pick = numbersOf(given.get('pick'));
        if (stands.length === 6) {
            camera.position.fromArray(stands);
            controls.target.fromArray(stands, 3);
            controls.update();
        }
        if (+given.get('fov') > 0) {
            camera.fov = Math.min(+given.get('fov'), 150);
        }
        state.picks = pick.length === 2 ? pick : null;
    }

    function writeAddress() {
        const written = new URLSearchParams();
        for (const key of Object.keys(readers)) {
            const value = state[key];
            written.set(key, value === true ? '1' : value === false ? '0' : value === null ? '' : String(value));
        }
        written.set('camera', [...camera.position.toArray(), ...controls.target.toArray()].map(x => +x.toPrecision(6)).join());
        location.replace('#' + written);
        message('The address holds this view now.');
        setTimeout(() => message(''), 1500);
    }

    /* --- drawing */

    function draw() {
        due = false;
        const width = innerWidth, height = innerHeight, edge = bakes.length > 1 ? Math.round(state.split * width) : width;
        const [one, other] = bakes;
        renderer.setScissorTest(false);
        renderer.clear();
        renderer.setScissorTest(true);
        [[one, 0, edge], [other, edge, width - edge]].forEach(([bake, left, wide]) => {
            if (bake && wide > 0) {
                renderer.setScissor(left, 0, wide, height);
                renderer.render(bake.scene, camera);
            }
        });
    }

    function redraw() {
        if (!due) {
            due = true;
            requestAnimationFrame(draw);
        }
    }

    function resize() {
        renderer.setPixelRatio(devicePixelRatio);
        renderer.setSize(innerWidth, innerHeight);
        camera.aspect = innerWidth / Math.max(innerHeight, 1);
        camera.updateProjectionMatrix();
        redraw();
    }

    function update() {
        const lights = bakes.flatMap(bake => VIEW.lightsOf(bake));
        if (!lights.includes(state.channel)) {
            state.channel = lights[0] || null;
        }
        if (!bakes.some(bake => VIEW.has(bake, state.mode))) {
            state.mode = 'lit';
        }
        bakes.forEach(bake => VIEW.show(bake, state));
        showState(lights);
        redraw();
    }

    function set(changes) {
        Object.assign(state, changes);
        update();
    }

    /* Moves the camera as `render` does: 35° to the right of the front, and 25° above. */
    function frame() {
        const center = box.getCenter(new THREE.Vector3()), radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1e-6);
        const wide = Math.min(1, camera.aspect), distance = radius / Math.sin(camera.fov * Math.PI / 360) / wide;
        const around = 35 * Math.PI / 180, above = 25 * Math.PI / 180;
        camera.position.set(Math.sin(around) * Math.cos(above), Math.sin(above), Math.cos(around) * Math.cos(above))
            .multiplyScalar(distance).add(center);
        controls.target.copy(center);
        controls.update();
    }

    /* Sets near and far by the model's distance. */
    function clip() {
        const sphere = box.getBoundingSphere(new THREE.Sphere()), radius = Math.max(sphere.radius, 1e-6);
        const distance = camera.position.distanceTo(sphere.center);
        camera.far = distance + 1.1 * radius;
        camera.near = Math.max(distance - 1.1 * radius, camera.far / 5000);
        camera.updateProjectionMatrix();
    }

    /* --- picking */

    function pick(x, y) {
        const device = [2 * x / innerWidth - 1, 1 - 2 * y / innerHeight];
        const at = bakes.map(bake => VIEW.pick(bake, camera, device[0], device[1]));
        for (const bake of bakes) {
            bake.meshes.forEach(mesh => mesh.material.uniforms.picked.value.set(-1, -1));
        }
        for (const found of at.filter(Boolean)) {
            if (found.texel) {
                found.object.material.uniforms.picked.value.set(found.texel[0], found.texel[1]);
            }
        }
        showPicked(at.filter(Boolean));
        redraw();
        return at[bakes.length > 1 && x / innerWidth > state.split ? 1 : 0];
    }

    /* --- input */

    const modeKeys = index => VIEW.MODES[index] && bakes.some(bake => VIEW.has(bake, VIEW.MODES[index][0]))
        ? set({mode: VIEW.MODES[index][0]}) : undefined;

    const keys = {
        t: () => set({texels: !state.texels}), w: () => set({wireframe: !state.wireframe}),
        s: () => set({sides: !state.sides}), f: () => { frame(); redraw(); }, l: writeAddress,
        d: () => set({theme: state.theme === 'dark' ? 'light' : 'dark'}), h: () => set({ui: !state.ui}),
        '+': () => set({exposure: Math.min(state.exposure + 0.5, 8)}), '-': () => set({exposure: Math.max(state.exposure - 0.5, -8)}),
        '[': () => set({split: Math.max(state.split - 0.05, 0)}), ']': () => set({split: Math.min(state.split + 0.05, 1)}),
        Enter: () => pick(innerWidth / 2, innerHeight / 2), Escape: () => pick(-1e6, -1e6)
    };

    function orbitBy(right, up) {
        const offset = camera.position.clone().sub(controls.target), s = new THREE.Spherical().setFromVector3(offset);
        s.theta += right;
        s.phi = Math.min(Math.max(s.phi + up, 0.01), Math.PI - 0.01);
        camera.position.setFromSpherical(s).add(controls.target);
        controls.update();
    }

    const arrows = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]};

    function watch(canvas) {
        let down = null;
        addEventListener('resize', resize);
        controls.addEventListener('change', () => { clip(); redraw(); });
        canvas.addEventListener('pointerdown', event => { down = [event.clientX, event.clientY]; });
        canvas.addEventListener('click', event => {
            if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 4) {
                pick(event.clientX, event.clientY);
            }
        });
        canvas.addEventListener('dblclick', event => {
            const found = pick(event.clientX, event.clientY);
            if (found) {
                controls.target.copy(found.point);
                controls.update();
            }
        });
        addEventListener('keydown', event => {
            const own = /^(INPUT|SELECT)$/.test(event.target.tagName) && event.target.type !== 'checkbox';
            if (own || event.ctrlKey || event.metaKey || event.altKey) {
                return;
            }
            if (event.target.tagName === 'BUTTON' && /^(Enter| )$/.test(event.key)) {
                return;
            }
            if (arrows[event.key] && event.target.getAttribute('role') !== 'radio') {
                orbitBy(...arrows[event.key]);
                event.preventDefault();
            } else if (/^[1-9]$/.test(event.key)) {
                modeKeys(event.key - 1);
            } else if (keys[event.key]) {
                keys[event.key]();
            }
        });
        byId('modes').addEventListener('keydown', event => {
            const step = {ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1}[event.key];
            const there = [...byId('modes').children].filter(button => !button.disabled);
            if (step && there.length > 0) {
                const next = there[(there.indexOf(event.target) + step + there.length) % there.length];
                next.focus();
                next.click();
                event.preventDefault();
            }
        });
        byId('exposure').oninput = event => set({exposure: +event.target.value});
        byId('split').oninput = event => set({split: +event.target.value});
        for (const name of ['texels', 'wireframe', 'sides']) {
            byId(name).onchange = event => set({[name]: event.target.checked});
        }
        for (const [id, key] of [['frame', 'f'], ['link', 'l'], ['theme', 'd'], ['hide', 'h'], ['show', 'h']]) {
            byId(id).onclick = keys[key];
        }
        const bar = byId('bar');
        bar.onpointerdown = event => bar.setPointerCapture(event.pointerId);
        bar.onpointermove = event => {
            if (bar.hasPointerCapture(event.pointerId)) {
                set({split: Math.min(Math.max(event.clientX / innerWidth, 0), 1)});
            }
        };
    }

    /* --- loading */

    /* Lets the browser show a message. */
    const breathe = () => new Promise(resolve => setTimeout(resolve, 0));

    async function loadModel(bake, tell) {
        const named = new Map((bake.files || []).map(file => [file.uri, VIEW.block(file.data)]));
        try {
            return await VIEW.loadScene(VIEW.block(bake.model), named, bake.uvSet, tell);
        } catch (error) {
            throw new Error(bake.name + ': ' + error.message);
        }
    }

    async function load(about) {
        let said = 0;
        const tell = text => {
            if (performance.now() - said > 100) {
                said = performance.now();
                message('Loading ' + text);
            }
        };
        bakes = about;
        await VIEW.loadPlanes(bakes, tell);
        const problems = new Set();
        for (const bake of bakes) {
            tell(bake.name);
            await breathe();
            bake.shared = bake.model === undefined ? bakes[0].shared : await loadModel(bake, tell);
            bake.shared.problems.forEach(problem => problems.add(bake.name + ': ' + problem));
        }
        showProblems([...problems]);
        box = new THREE.Box3();
        for (const bake of bakes) {
            VIEW.build(bake, bake.shared);
            box.expandByObject(bake.scene);
        }
    }

    async function begin() {
        const canvas = byId('view'), context = canvas.getContext('webgl2', {antialias: true, alpha: true});
        if (!context) {
            throw new Error('This browser shows no WebGL 2, which the view is drawn with. It may be turned off in its settings, or the ' +
                'graphics driver be too old.');
        }
        const about = JSON.parse(byId('about').textContent);
        renderer = new THREE.WebGLRenderer({canvas, context});
        renderer.autoClear = false;
        renderer.setClearColor(0, 0);
        camera = new THREE.PerspectiveCamera(45, innerWidth / Math.max(innerHeight, 1), 0.1, 100);
        controls = new THREE.OrbitControls(camera, canvas);
        controls.enableKeys = false;
        await load(about);
        frame();
        readAddress();
        clip();
        makeModes();
        byId('channel').onchange = event => set({channel: event.target.value});
        watch(canvas);
        resize();
        update();
        if (state.picks) {
            pick(state.picks[0] * innerWidth, state.picks[1] * innerHeight);
        }
        draw();
        message('');
        document.documentElement.dataset.state = 'ready';
    }

    begin().catch(error => {
        message(error.message, true);
        document.documentElement.dataset.state = 'failed';
    });
})();
