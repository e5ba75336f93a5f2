// What the viewer takes of three.js; README.md says how three.min.js is made from this file.
export {
  BufferAttribute, BufferGeometry, Color, Matrix4, PerspectiveCamera, Points, Scene, ShaderMaterial, Vector3,
  WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
