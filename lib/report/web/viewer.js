// 3-D view of grains and fines over time (three.js r111 of Debian 12). Orbit by drag, zoom by wheel, move by shift-drag.
(function () {
    "use strict";
    var holder = document.getElementById("viewer"), say = document.getElementById("viewer-message");
    if (!holder) return;
    var scenes = JSON.parse(document.getElementById("scenes").textContent);
    function fail(text) { holder.style.display = "none"; say.textContent = text; }
    if (typeof THREE === "undefined" || scenes.length === 0) return;
    if (typeof DecompressionStream === "undefined")
        return fail("The 3-D view needs a browser of 2023 or later; the figures above show the same run.");

    var renderer;
    try {
        renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    } catch (error) {
        return fail("This browser offers no WebGL, so the 3-D view is off; the figures above show the same run.");
    }
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    renderer.setClearColor(0xffffff);
    renderer.localClippingEnabled = true;
    holder.appendChild(renderer.domElement);

    var camera = new THREE.PerspectiveCamera(30, 1, 1e-4, 100);
    camera.up.set(0, 0, 1);
    var target = new THREE.Vector3(), distance = 1, azimuth = -0.9, elevation = 0.35;
    var clip = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);
    var world = null, current = null, pending = false;
    var layers = [0x0072B2, 0x009E73, 0xD55E00];

    function draw() {
        if (pending) return;
        pending = true;
        requestAnimationFrame(function () {
            pending = false;
            var width = holder.clientWidth, height = holder.clientHeight;
            renderer.setSize(width, height);
            camera.aspect = width / height;
            camera.near = distance / 100;
            camera.far = distance * 10;
            camera.updateProjectionMatrix();
            camera.position.set(Math.cos(elevation) * Math.sin(azimuth), -Math.cos(elevation) * Math.cos(azimuth), Math.sin(elevation));
            camera.position.multiplyScalar(distance).add(target);
            camera.lookAt(target);
            if (world) renderer.render(world, camera);
        });
    }

    // Base64 -> inflate -> byte planes -> 16-bit words (lib/report/scene.cpp writes them).
    function unpack(scene) {
        var text = atob(scene.data), bytes = new Uint8Array(text.length);
        for (var i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
        var stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
        return new Response(stream).arrayBuffer().then(function (buffer) {
            var planes = new Uint8Array(buffer), words = new Uint16Array(scene.words);
            for (var i = 0; i < scene.words; ++i) words[i] = planes[i] | planes[scene.words + i] << 8;
            return words;
        });
    }

    function meshes(scene, words, at) {
        return scene.meshes.map(function (mesh) {
            var positions = new Float32Array(3 * mesh.vertices), index = new Uint32Array(3 * mesh.triangles), axis, i, last;
            for (axis = 0; axis < 3; ++axis)
                for (i = 0, last = 0; i < mesh.vertices; ++i) {
                    last = last + words[at++] & 65535;
                    positions[3 * i + axis] = mesh.low[axis] + mesh.extent * last / 65535;
                }
            for (axis = 0; axis < 3; ++axis)
                for (i = 0, last = 0; i < mesh.triangles; ++i) index[3 * i + axis] = last = last + words[at++] & 65535;
            var geometry = new THREE.BufferGeometry();
            geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
            geometry.setIndex(new THREE.BufferAttribute(index, 1));
            geometry.computeVertexNormals();
            return geometry;
        });
    }

    function build(scene, words) {
        var grains = scene.grain_mesh.length, spheres = scene.sphere_radius.length, bodies = grains + spheres, frames = scene.times.length;
        var made = { scene: scene, root: new THREE.Scene(), groups: [], frames: frames, bodies: bodies };
        // Undo the differences between frames.
        made.positions = words.slice(0, frames * 3 * bodies);
        for (var i = 3 * bodies; i < made.positions.length; ++i) made.positions[i] += made.positions[i - 3 * bodies];
        var at = frames * 3 * bodies;
        made.turns = new Int16Array(words.slice(at, at + frames * 4 * grains).buffer);
        for (i = 4 * grains; i < made.turns.length; ++i) made.turns[i] += made.turns[i - 4 * grains];
        var geometries = meshes(scene, words, at + frames * 4 * grains);

        made.root.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 0.85));
        var sun = new THREE.DirectionalLight(0xffffff, 0.55);
        sun.position.set(-1, -2, 3);
        made.root.add(sun);
        made.sand = new THREE.MeshLambertMaterial({ color: 0xE3CFA4, side: THREE.DoubleSide, clippingPlanes: [clip], transparent: true });
        // Bodies in their shapes: one set of instances for each mesh and colour.
        function addGroup(geometry, group, members, turned) {
            // Group 3 are grains: they fade with the slider, the fines stay.
            var material = group === 3 ? made.sand : new THREE.MeshLambertMaterial({ color: layers[group], side: THREE.DoubleSide, clippingPlanes: [clip] });
            var instances = new THREE.InstancedMesh(geometry, material, members.length);
            instances.frustumCulled = false;
            made.root.add(instances);
            made.groups.push({ members: members, mesh: instances, turned: turned });
        }
        geometries.forEach(function (geometry, mesh) {
            for (var group = 0; group < 4; ++group) {
                var members = [];
                scene.grain_mesh.forEach(function (of, g) { if (of === mesh && scene.grain_group[g] === group) members.push(g); });
                // A geometry of its own: r111 keeps the matrices of the last group bound where two groups share one.
                if (members.length > 0) addGroup(geometry.clone(), group, members, true);
            }
        });
        for (var group = 0; group < 4; ++group) {
            var members = [];
            scene.sphere_group.forEach(function (of, s) { if (of === group) members.push(s); });
            if (members.length === 0) continue;
            addGroup(new THREE.SphereBufferGeometry(1, group === 3 ? 32 : 14, group === 3 ? 24 : 10), group, members, false);
        }
        frameLines(made);
        return made;
    }

    // Edges of the domain, and the filter plate with its holes.
    function frameLines(made) {
        var scene = made.scene, low = scene.domain_origin || scene.low, size = scene.domain_size || scene.extent, points = [];
        function line(a, b) { points.push(a[0], a[1], a[2], b[0], b[1], b[2]); }
        function rectangle(x0, y0, x1, y1, z) {
            line([x0, y0, z], [x1, y0, z]); line([x1, y0, z], [x1, y1, z]); line([x1, y1, z], [x0, y1, z]); line([x0, y1, z], [x0, y0, z]);
        }
        var x1 = low[0] + size[0], y1 = low[1] + size[1], z1 = low[2] + size[2];
        rectangle(low[0], low[1], x1, y1, low[2]);
        rectangle(low[0], low[1], x1, y1, z1);
        [[low[0], low[1]], [x1, low[1]], [x1, y1], [low[0], y1]].forEach(function (c) { line([c[0], c[1], low[2]], [c[0], c[1], z1]); });
        scene.plates.forEach(function (plate) {
            rectangle(low[0], low[1], x1, y1, plate[0]);
            if (!(plate[1] > 0) || !(plate[2] > 0)) return;
            var nx = Math.floor(size[0] / plate[2] + 1e-6), ny = Math.floor(size[1] / plate[2] + 1e-6);
            for (var i = 0; i < nx; ++i)
                for (var j = 0; j < ny; ++j) {
                    var cx = low[0] + (i + 0.5) * plate[2], cy = low[1] + (j + 0.5) * plate[2], r = plate[1] / 2;
                    rectangle(cx - r, cy - r, cx + r, cy + r, plate[0]);
                }
        });
        var geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
        made.root.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x8a949e })));
        made.centre = new THREE.Vector3(low[0] + size[0] / 2, low[1] + size[1] / 2, low[2] + size[2] / 2);
        made.low_y = low[1];
        made.size_y = size[1];
        made.span = Math.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]);
    }

    function show(frame) {
        var made = current, scene = made.scene, base = frame * 3 * made.bodies, matrix = new THREE.Matrix4();
        function position(b, axis) {
            var q = made.positions[base + axis * made.bodies + b];
            return q === 65535 ? NaN : scene.low[axis] + scene.extent[axis] * q / 65534;
        }
        var grains = scene.grain_mesh.length, place = new THREE.Vector3(), size = new THREE.Vector3(), turned = new THREE.Quaternion();
        function turn(g, c) { return made.turns[(frame * 4 + c) * grains + g] / 32767; }
        made.groups.forEach(function (group) {
            group.members.forEach(function (s, k) {
                var b = group.turned ? s : grains + s, x = position(b, 0);
                var scale = !isFinite(x) ? 0 : group.turned ? scene.grain_scale[s] : scene.sphere_radius[s];
                if (group.turned) turned.set(turn(s, 1), turn(s, 2), turn(s, 3), turn(s, 0)).normalize();
                if (scale > 0) place.set(x, position(b, 1), position(b, 2));
                matrix.compose(place, turned, size.set(scale, scale, scale));
                group.mesh.setMatrixAt(k, matrix);
            });
            group.mesh.instanceMatrix.needsUpdate = true;
        });
        time.textContent = "t = " + parseFloat(scene.times[frame].toPrecision(4)) + " s";
        draw();
    }

    var slider = document.getElementById("view-frame"), time = document.getElementById("view-time");
    var cut = document.getElementById("view-cut"), fade = document.getElementById("view-fade"), play = document.getElementById("view-play");
    var choice = document.getElementById("view-case"), playing = null;

    function applyCut() {
        clip.constant = -(current.low_y - 0.02 * current.size_y + 1.04 * current.size_y * cut.value / 100);
        draw();
    }
    function applyFade() {
        current.sand.opacity = fade.value / 100;
        current.sand.depthWrite = fade.value > 95;
        draw();
    }
    function open(index) {
        say.textContent = "Unpacking the scene ...";
        unpack(scenes[index]).then(function (words) {
            current = build(scenes[index], words);
            world = current.root;
            target.copy(current.centre);
            distance = 1.9 * current.span;
            slider.max = current.frames - 1;
            slider.value = current.frames - 1;
            applyCut();
            applyFade();
            show(current.frames - 1);
            say.textContent = scenes[index].note;
            document.body.setAttribute("data-viewer", "ready");
        }).catch(function (error) { fail("The 3-D view could not be built (" + error + ")."); });
    }

    slider.addEventListener("input", function () { show(Number(slider.value)); });
    cut.addEventListener("input", applyCut);
    fade.addEventListener("input", applyFade);
    choice.addEventListener("change", function () { open(Number(choice.value)); });
    play.addEventListener("click", function () {
        if (playing) { clearInterval(playing); playing = null; play.textContent = "Play"; return; }
        play.textContent = "Stop";
        playing = setInterval(function () {
            slider.value = (Number(slider.value) + 1) % current.frames;
            show(Number(slider.value));
        }, 120);
    });

    var grabbed = null;
    renderer.domElement.addEventListener("pointerdown", function (event) {
        grabbed = { x: event.clientX, y: event.clientY, move: event.shiftKey || event.button === 2 };
        renderer.domElement.setPointerCapture(event.pointerId);
    });
    renderer.domElement.addEventListener("pointermove", function (event) {
        if (!grabbed) return;
        var dx = event.clientX - grabbed.x, dy = event.clientY - grabbed.y;
        grabbed.x = event.clientX;
        grabbed.y = event.clientY;
        if (grabbed.move) {
            var step = distance / holder.clientHeight * 0.55;
            var right = new THREE.Vector3(), up = new THREE.Vector3();
            camera.matrix.extractBasis(right, up, new THREE.Vector3());
            target.addScaledVector(right, -dx * step).addScaledVector(up, dy * step);
        } else {
            azimuth -= dx * 0.008;
            elevation = Math.max(-1.5, Math.min(1.5, elevation + dy * 0.008));
        }
        draw();
    });
    renderer.domElement.addEventListener("pointerup", function () { grabbed = null; });
    renderer.domElement.addEventListener("contextmenu", function (event) { event.preventDefault(); });
    renderer.domElement.addEventListener("wheel", function (event) {
        event.preventDefault();
        distance *= Math.exp(0.001 * event.deltaY);
        draw();
    }, { passive: false });
    window.addEventListener("resize", draw);
    open(0);
})();
