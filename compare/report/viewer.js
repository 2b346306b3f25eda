// SPDX-License-Identifier: Apache-2.0
// The turning view of each drape in the report. One WebGL renderer draws them all, each picture is
// then copied to its own canvas: browsers allow few WebGL contexts, a report may hold many drapes.
(() => {
  'use strict';
  const figures = [...document.querySelectorAll('figure.turn')];
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
  } catch (error) {
    return;  // without WebGL the still pictures stay
  }
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const WIDE = 1000, TALL = 620;
  renderer.setPixelRatio(1);
  renderer.setSize(WIDE * ratio, TALL * ratio);
  renderer.setClearColor(0xf5f7f9);

  /// Points as x, y, z in a row; every four are a quad.
  function quads(points) {
    const corners = new Float32Array(points.length / 12 * 18);
    const lines = new Float32Array(points.length / 12 * 24);
    for (let q = 0; q < points.length / 12; ++q) {
      [0, 1, 2, 0, 2, 3].forEach((c, i) => {
        for (let k = 0; k < 3; ++k) corners[18 * q + 3 * i + k] = points[12 * q + 3 * c + k];
      });
      [0, 1, 1, 2, 2, 3, 3, 0].forEach((c, i) => {
        for (let k = 0; k < 3; ++k) lines[24 * q + 3 * i + k] = points[12 * q + 3 * c + k];
      });
    }
    const faces = new THREE.BufferGeometry(), edges = new THREE.BufferGeometry();
    faces.setAttribute('position', new THREE.BufferAttribute(corners, 3));
    edges.setAttribute('position', new THREE.BufferAttribute(lines, 3));
    faces.computeVertexNormals();
    return {faces, edges};
  }

  function group(...parts) {
    const made = new THREE.Group();
    parts.forEach(part => made.add(part));
    return made;
  }

  function solid(faces, colour, side) {
    const material = new THREE.MeshLambertMaterial({color: colour, side});
    material.polygonOffset = true;  // lines on the faces stay whole
    material.polygonOffsetFactor = material.polygonOffsetUnits = 1;
    return new THREE.Mesh(faces, material);
  }

  /// The simulated sheet: light on its printed side, darker on its back.
  function clothOf(points) {
    const {faces, edges} = quads(points);
    return group(solid(faces, 0xeceff3, THREE.FrontSide), solid(faces, 0xb9b2aa, THREE.BackSide),
                 new THREE.LineSegments(edges, new THREE.LineBasicMaterial({color: 0x8a94a0})));
  }

  /// The measured sheet: every cell with four marks, in the colours of their errors.
  function realOf(cells) {
    const points = [], colours = [];
    for (const cell of cells) points.push(...cell.slice(0, 12));
    const {faces, edges} = quads(points);
    for (const cell of cells)
      for (const c of [0, 1, 2, 0, 2, 3]) colours.push(...new THREE.Color(cell[12 + c]).toArray());
    faces.setAttribute('color', new THREE.BufferAttribute(new Float32Array(colours), 3));
    const material = new THREE.MeshBasicMaterial({vertexColors: THREE.VertexColors, side: THREE.DoubleSide});
    material.polygonOffset = true;
    material.polygonOffsetFactor = material.polygonOffsetUnits = 1;
    return group(new THREE.Mesh(faces, material),
                 new THREE.LineSegments(edges, new THREE.LineBasicMaterial({color: 0x1d2733})));
  }

  function rod(from, to, radius, material) {
    const along = to.clone().sub(from);
    const mesh = new THREE.Mesh(new THREE.CylinderBufferGeometry(radius, radius, Math.max(along.length(), 1e-6), 6), material);
    mesh.position.copy(from).addScaledVector(along, 0.5);
    mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.clone().normalize());
    return mesh;
  }

  /// A ball at each real mark and a rod to its place on the virtual sheet.
  function marksOf(marks, size) {
    const made = new THREE.Group(), ball = new THREE.SphereBufferGeometry(0.0075 * size, 12, 8);
    const rim = new THREE.MeshBasicMaterial({color: 0x1d2733, side: THREE.BackSide});
    for (const mark of marks) {
      const material = new THREE.MeshBasicMaterial({color: mark[6]});
      const real = new THREE.Vector3(...mark.slice(0, 3)), place = new THREE.Vector3(...mark.slice(3, 6));
      const dot = new THREE.Mesh(ball, material), outline = new THREE.Mesh(ball, rim);
      dot.position.copy(real);
      outline.position.copy(real);
      outline.scale.setScalar(1.25);
      made.add(dot, outline, rod(real, place, 0.003 * size, material));
    }
    return made;
  }

  function start(figure) {
    const data = JSON.parse(document.getElementById(figure.dataset.view).textContent);
    const canvas = figure.querySelector('canvas'), output = figure.querySelector('output');
    canvas.width = WIDE * ratio;
    canvas.height = TALL * ratio;
    const pen = canvas.getContext('2d');
    figure.hidden = false;
    const box = new THREE.Box3();
    for (const list of [data.cloth, data.object])
      for (let i = 0; i < list.length; i += 3) box.expandByPoint(new THREE.Vector3(list[i], list[i + 1], list[i + 2]));
    for (const mark of data.marks) box.expandByPoint(new THREE.Vector3(...mark.slice(0, 3)));
    const middle = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3()).length();
    const scene = new THREE.Scene(), camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 4 * size);
    camera.up.set(0, 0, 1);
    scene.add(camera, new THREE.HemisphereLight(0xffffff, 0xb0b4ba, 0.55));
    const lamp = new THREE.DirectionalLight(0xffffff, 0.5);
    lamp.position.set(-0.45, 0.55, 1);  // in the camera's frame, so that it turns with the viewer
    camera.add(lamp);
    lamp.target = scene;
    const parts = {
      cloth: clothOf(data.cloth), real: realOf(data.real), marks: marksOf(data.marks, size),
      object: solid(quads(data.object).faces, 0xcdaa78, THREE.DoubleSide),
    };
    Object.values(parts).forEach(part => scene.add(part));
    const first = {azimuth: -1.05, height: 0.5, zoom: 1};
    let view = {...first};
    function draw() {
      const ce = Math.cos(view.height);
      camera.position.set(Math.cos(view.azimuth) * ce, Math.sin(view.azimuth) * ce, Math.sin(view.height)).multiplyScalar(2 * size).add(middle);
      camera.lookAt(middle);
      const tall = size / (2.8 * view.zoom);
      Object.assign(camera, {left: -tall * WIDE / TALL, right: tall * WIDE / TALL, top: tall, bottom: -tall});
      camera.updateProjectionMatrix();
      renderer.render(scene, camera);
      pen.drawImage(renderer.domElement, 0, 0);
      canvas.dataset.drawn = renderer.info.render.triangles;
    }
    function turn(a, h) {
      view.azimuth += a;
      view.height = Math.max(-1.55, Math.min(1.55, view.height + h));
      draw();
    }
    function zoom(factor) { view.zoom = Math.max(0.4, Math.min(8, view.zoom * factor)); draw(); }
    const keys = {
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1),
      ArrowDown: () => turn(0, -0.1), '+': () => zoom(1.15), '-': () => zoom(1 / 1.15),
      '0': () => { view = {...first}; draw(); },
    };
    canvas.addEventListener('keydown', e => { if (keys[e.key]) { keys[e.key](); e.preventDefault(); } });
    let last = null;
    canvas.addEventListener('pointerdown', e => { last = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { last = null; });
    function tell(e) {
      const edge = canvas.getBoundingClientRect();
      const x = (e.clientX - edge.left) / edge.width * WIDE, y = (e.clientY - edge.top) / edge.height * TALL;
      let nearest = 14, text = '';
      for (const mark of parts.marks.visible ? data.marks : []) {
        const p = new THREE.Vector3(...mark.slice(0, 3)).project(camera);
        const off = Math.hypot((p.x + 1) / 2 * WIDE - x, (1 - p.y) / 2 * TALL - y);
        if (off < nearest) { nearest = off; text = mark[7]; }
      }
      output.textContent = text;
    }
    canvas.addEventListener('pointermove', e => {
      if (!last) return tell(e);
      turn(-(e.clientX - last[0]) * 0.008, (e.clientY - last[1]) * 0.008);
      last = [e.clientX, e.clientY];
    });
    // The page scrolls under the pointer as everywhere; with Ctrl held, or two fingers, it zooms.
    canvas.addEventListener('wheel', e => {
      if (!e.ctrlKey) return;
      zoom(e.deltaY < 0 ? 1.1 : 1 / 1.1);
      e.preventDefault();
    }, {passive: false});
    for (const button of figure.querySelectorAll('button')) button.addEventListener('click', () => {
      const part = parts[button.dataset.key];
      part.visible = !part.visible;
      button.setAttribute('aria-pressed', part.visible);
      draw();
    });
    draw();
  }
  figures.forEach(start);
})();
