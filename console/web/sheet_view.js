// SPDX-License-Identifier: Apache-2.0
// 3D view of the measured sheet, the object and the virtual sheet, with a rod for each mark's distance.

let renderer = null, loading = null;

function loadThree() {
  loading ??= new Promise((resolve, reject) => {
    const script = document.createElement('script');
    script.src = 'three.js';
    script.addEventListener('load', resolve);
    script.addEventListener('error', reject);
    document.head.append(script);
  });
  return loading;
}

/// Colours from small (dark) to large (light), ordered by lightness.
function colourOf(part) {
  return new THREE.Color().setHSL(0.75 - 0.6 * part, 0.75, 0.3 + 0.4 * part);
}

function surface(points, colour, side) {
  const corners = [], edges = [];
  for (let q = 0; q + 11 < points.length; q += 12) {
    for (const c of [0, 1, 2, 0, 2, 3]) corners.push(...points.slice(q + 3 * c, q + 3 * c + 3));
    for (const c of [0, 1, 1, 2, 2, 3, 3, 0]) edges.push(...points.slice(q + 3 * c, q + 3 * c + 3));
  }
  const faces = new THREE.BufferGeometry(), lines = new THREE.BufferGeometry();
  faces.setAttribute('position', new THREE.Float32BufferAttribute(corners, 3));
  lines.setAttribute('position', new THREE.Float32BufferAttribute(edges, 3));
  faces.computeVertexNormals();
  const material = new THREE.MeshLambertMaterial({color: colour, side, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1});
  const group = new THREE.Group();
  group.add(new THREE.Mesh(faces, material), new THREE.LineSegments(lines, new THREE.LineBasicMaterial({color: 0x55606c})));
  return group;
}

function solid(object) {
  const shapes = {
    sphere: () => new THREE.SphereBufferGeometry(object.radius_mm, 40, 24),
    box: () => new THREE.BoxBufferGeometry(...object.size_mm),
    cylinder: () => new THREE.CylinderBufferGeometry(object.radius_mm, object.radius_mm, object.height_mm, 48).rotateX(Math.PI / 2),
  };
  if (!shapes[object.is]) return null;
  const mesh = new THREE.Mesh(shapes[object.is](), new THREE.MeshLambertMaterial({color: 0xcdaa78}));
  const r = object.rotation;
  if (r) mesh.setRotationFromMatrix(new THREE.Matrix4().set(r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6], r[7], r[8], 0, 0, 0, 0, 1));
  mesh.position.set(...object.centre_mm);
  return mesh;
}

const view = {azimuth: -1.05, height: 0.5, zoom: 1};

let kept = {text: '', figure: null};

/// A canvas rotated by arrow keys or the pointer; reused while the sheet is unchanged.
export async function sheetView(sheet) {
  const text = JSON.stringify(sheet);
  if (kept.text !== text) kept = {text, figure: await made(sheet)};
  return kept.figure;
}

async function made(sheet) {
  const canvas = document.createElement('canvas');
  const words = document.createElement('p');
  canvas.className = 'sheet';
  canvas.id = 'sheet-view';
  canvas.width = 1280;
  canvas.height = 720;
  canvas.tabIndex = 0;
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', `Drape ${sheet.drape} in space: ${sheet.marks.length} marks; arrow keys turn, plus and minus zoom, 0 resets`);
  const figure = document.createElement('figure');
  figure.append(canvas, words);
  try {
    await loadThree();
    renderer ??= new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
  } catch {
    words.textContent = 'This browser draws nothing in space (WebGL is off); the report has still pictures.';
    canvas.hidden = true;
    return figure;
  }
  renderer.setSize(canvas.width, canvas.height, false);
  renderer.setClearColor(0xf5f7f9);
  const scene = new THREE.Scene();
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);
  camera.up.set(0, 0, 1);
  const lamp = new THREE.DirectionalLight(0xffffff, 0.6);
  lamp.position.set(-0.4, 0.5, 1);
  lamp.target = scene;
  camera.add(lamp);
  scene.add(camera, new THREE.HemisphereLight(0xffffff, 0xb0b4ba, 0.6));
  scene.add(surface(sheet.real, 0x7fb2e5, THREE.DoubleSide));
  if (sheet.virtual.length) scene.add(surface(sheet.virtual, 0xe4e2de, THREE.DoubleSide));
  const box = new THREE.Box3();
  for (const object of sheet.objects.map(solid).filter(Boolean)) {
    scene.add(object);
    box.expandByObject(object);
  }
  for (const mark of sheet.marks) box.expandByPoint(new THREE.Vector3(...mark.at_mm));
  const size = Math.max(box.getSize(new THREE.Vector3()).length(), 1), middle = box.getCenter(new THREE.Vector3());
  const largest = Math.max(...sheet.marks.map(mark => mark.distance_mm ?? 0));
  const ball = new THREE.SphereBufferGeometry(0.007 * size, 10, 8);
  for (const mark of sheet.marks) {
    const colour = largest > 0 ? colourOf((mark.distance_mm ?? 0) / largest) : new THREE.Color(0x0b4a8f);
    const dot = new THREE.Mesh(ball, new THREE.MeshBasicMaterial({color: colour}));
    dot.position.set(...mark.at_mm);
    scene.add(dot);
  }
  const sd = sheet.marks.map(mark => mark.sd_mm).filter(value => value !== null).sort((a, b) => a - b);
  words.textContent = `${sheet.marks.length} marks measured, ${sheet.gaps.length} without a place; a mark's standard deviation ${sd.length ? `${sd[Math.floor(sd.length / 2)].toFixed(4)} mm (median)` : 'not known'}. ` +
    (largest > 0 ? `Balls: distance to the virtual cloth (grey), dark 0 mm to light ${largest.toFixed(1)} mm.` : '');
  const pen = canvas.getContext('2d');
  function draw() {
    const flat = Math.cos(view.height);
    camera.position.set(Math.cos(view.azimuth) * flat, Math.sin(view.azimuth) * flat, Math.sin(view.height)).multiplyScalar(2 * size).add(middle);
    camera.lookAt(middle);
    const tall = 0.42 * size / view.zoom, wide = tall * canvas.width / canvas.height;
    Object.assign(camera, {left: -wide, right: wide, top: tall, bottom: -tall, near: 0, far: 4 * size});
    camera.updateProjectionMatrix();
    renderer.render(scene, camera);
    pen.drawImage(renderer.domElement, 0, 0);
    canvas.dataset.drawn = renderer.info.render.triangles;
  }
  const turn = (a, b) => { view.azimuth += a; view.height = Math.max(-1.5, Math.min(1.5, view.height + b)); draw(); };
  const zoom = factor => { view.zoom = Math.max(0.3, Math.min(10, view.zoom * factor)); draw(); };
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
    '+': () => zoom(1.2), '-': () => zoom(1 / 1.2),
    '0': () => { Object.assign(view, {azimuth: -1.05, height: 0.5, zoom: 1}); draw(); },
  };
  canvas.addEventListener('keydown', event => { if (keys[event.key]) { keys[event.key](); event.preventDefault(); } });
  let last = null;
  canvas.addEventListener('pointerdown', event => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener('pointerup', () => { last = null; });
  canvas.addEventListener('pointermove', event => {
    if (!last) return;
    turn((last[0] - event.clientX) * 0.008, (event.clientY - last[1]) * 0.008);
    last = [event.clientX, event.clientY];
  });
  draw();
  return figure;
}
