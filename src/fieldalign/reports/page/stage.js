// A stage: the canvas of a viewer, the clouds of points that stand on it, and their colours, of this page's style.
// Each viewer of a page (pair.js, model.js) has one of its own, and a camera before it (camera.js).
"use strict";

const COLOURINGS = ["cloud", "agreement", "distance", "tint"]; // as the shader numbers them

// The viewer that somebody used last: the keys are for it. The first one before anybody did.
let atHand = null;

// Numbers of a type out of base64.
const unpacked = (text, Type) => {
  if (Uint8Array.fromBase64) return new Type(Uint8Array.fromBase64(text).buffer);
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return new Type(bytes.buffer);
};

const VERTEX = `
  attribute float state, distance;
  attribute vec3 tint;
  uniform int colouring;
  uniform vec3 own, alone, contradicts, agrees, inside, on, outside, upwards;
  uniform mat4 after;
  uniform float size, smallest, scale, ceiling;
  varying vec3 colour;
  void main() {
    vec4 place = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * place;
    if (dot(upwards, (after * vec4(position, 1.0)).xyz) > ceiling) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = clamp(size * scale / -place.z, smallest, smallest + 12.0);
    colour = own;
    if (colouring == 1) colour = state < 0.5 ? alone : state < 1.5 ? contradicts : agrees;
    if (colouring == 2) colour = state < 0.5 ? alone : mix(on, distance < 0.0 ? inside : outside, abs(distance));
    if (colouring == 3) colour = tint;
    float facing = length(normal) > 0.1 ? abs(dot(normalize(normalMatrix * normal), normalize(place.xyz))) : 1.0;
    colour *= 0.7 + 0.3 * facing;
  }`;
const FRAGMENT = `
  varying vec3 colour;
  void main() {
    vec2 off = gl_PointCoord - 0.5;
    if (dot(off, off) > 0.25) discard;
    gl_FragColor = vec4(colour, 1.0);
  }`;
const ATTRIBUTES = { // name in the data: name in the shader, type, numbers of a point, whether they count to 1
  points: ["position", Int16Array, 3, true], normals: ["normal", Int8Array, 3, true],
  states: ["state", Uint8Array, 1, false], distances: ["distance", Int8Array, 1, true],
};

// The stage in a section of the page; null where the browser draws nothing in 3D.
const stageIn = (root) => {
  const canvas = root.querySelector("canvas");
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, antialias: false, alpha: true, preserveDrawingBuffer: true });
  } catch {
    root.classList.add("off");
    return null;
  }
  const shared = { scale: { value: 1 }, ceiling: { value: 1e30 }, upwards: { value: new THREE.Vector3() } };
  for (const name of ["alone", "contradicts", "agrees", "inside", "on", "outside"]) {
    shared[name] = { value: new THREE.Color() };
  }
  const scene = new THREE.Scene();
  const layers = new Map();
  let waiting = false;

  const stage = {
    root, canvas, renderer, scene, shared, layers, beforeDrawing: () => {},

    // A cloud: what makes places of its 16-bit steps, how far its points lie apart, and the swatch with its colour.
    // wide: of beads, how many pixels their line is wide at least.
    add(name, packed, { spacing = packed.spacing, swatch = name, wide = 1.6 } = {}) {
      const geometry = new THREE.BufferGeometry();
      for (const [key, [attribute, Type, items, counts]] of Object.entries(ATTRIBUTES)) {
        if (packed[key]) {
          geometry.setAttribute(attribute, new THREE.BufferAttribute(unpacked(packed[key], Type), items, counts));
        }
      }
      const local = new THREE.Matrix4().makeTranslation(...packed.centre)
        .scale(new THREE.Vector3(packed.half, packed.half, packed.half));
      const uniforms = {
        ...shared, own: { value: new THREE.Color() }, colouring: { value: 0 }, size: { value: spacing },
        smallest: { value: wide }, after: { value: local.clone() },
      };
      const material = new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms });
      const object = new THREE.Points(geometry, material);
      object.matrixAutoUpdate = false;
      object.frustumCulled = false;
      object.matrix.copy(local);
      scene.add(object);
      layers.set(name, { object, uniforms, spacing, local, swatch });
    },

    clear() {
      for (const { object } of layers.values()) {
        scene.remove(object);
        object.geometry.dispose();
        object.material.dispose();
      }
      layers.clear();
    },

    // What lies above a height along the scene's vertical is hidden; null: nothing.
    hideAbove(height) {
      shared.ceiling.value = height ?? 1e30;
    },

    // Colours stand once, in the style of the page; the legend's swatches tell them.
    recolour() {
      for (const name of ["alone", "contradicts", "agrees"]) shared[name].value = styled(`swatch ${name}`, "backgroundColor");
      for (const name of ["inside", "on", "outside"]) shared[name].value = styled(`colour-${name}`, "color");
      for (const { uniforms, swatch } of layers.values()) uniforms.own.value = styled(`swatch ${swatch}`, "backgroundColor");
      stage.draw();
    },

    // Draws, when the browser draws next.
    draw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        if (!layers.size) return;
        stage.beforeDrawing();
        renderer.render(scene, stage.camera);
      });
    },
  };
  const take = () => (atHand = stage);
  root.addEventListener("pointerdown", take);
  root.addEventListener("focusin", take);
  atHand ??= stage;
  return stage;
};

// A colour of the page's style, as something of a class has it.
const styled = (names, property) => {
  const probe = document.createElement("i");
  probe.className = names;
  document.body.append(probe);
  const [r, g, b] = getComputedStyle(probe)[property].match(/[\d.]+/g).map(Number);
  probe.remove();
  return new THREE.Color(r / 255, g / 255, b / 255);
};
