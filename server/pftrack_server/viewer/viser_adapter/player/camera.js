// The camera in the frame: where it stands, and how far the scene is raised for whoever looks from there.
/** @import { Relief, View } from "./recording.js" */

const FAR = 20;
const NEAR = 1 / 50;
const EXACT = 0.01;
const ORBIT = [1 / 20, 10];

/**
 * How far from its target a view stands, for a shape of the window.
 *
 * @param {View} view
 * @param {number} aspect
 */
export function distance({ aspects, distances }, aspect) {
  const last = aspects.length - 1;
  const next = aspects.findIndex((value) => value >= aspect);
  const at = Math.max(1, next < 0 ? last : next);
  const [low, high] = [1 / aspects[at - 1], 1 / aspects[at]];
  const share = Math.min(1, Math.max(0, (1 / aspect - low) / (high - low)));
  return distances[at - 1] + share * (distances[at] - distances[at - 1]);
}

/**
 * Where the camera of a view stands.
 *
 * @param {View} view
 * @param {number} aspect
 */
function standing(view, aspect) {
  const far = distance(view, aspect);
  return view.target.map((value, axis) => value + far * view.towards[axis]);
}

/**
 * A place of three.js as viser counts it: which way is up turns its whole world.
 *
 * @param {NonNullable<Window["__viserMutable"]>} viewer
 * @param {ViserVector} place
 */
function inScene({ nodeRefFromName: nodes }, place) {
  return nodes?.[""]?.worldToLocal(place.clone()) ?? place;
}

/**
 * Whether the camera stands where a view has it. While it is opened, viser moves it once more to where it begins; and a
 * window of another shape needs another place.
 *
 * @param {View} view
 * @param {NonNullable<Window["__viserMutable"]>} viewer
 */
export function isInPlace(view, viewer) {
  const { camera } = viewer;
  if (!camera) return true;
  const [x, y, z] = standing(view, camera.aspect);
  const position = inScene(viewer, camera.position);
  return Math.hypot(position.x - x, position.y - y, position.z - z) < EXACT * distance(view, camera.aspect);
}

/**
 * viser's messages that bring the camera to a view.
 *
 * @param {View} view
 * @param {number} aspect
 */
export function messagesTo(view, aspect) {
  const far = distance(view, aspect);
  return [
    { type: "SetCameraMinOrbitDistanceMessage", min_orbit_distance: far * ORBIT[0] },
    { type: "SetCameraMaxOrbitDistanceMessage", max_orbit_distance: far * ORBIT[1] },
    { type: "SetCameraNearMessage", near: far * NEAR, initial: false },
    { type: "SetCameraFarMessage", far: far * FAR, initial: false },
    { type: "SetCameraFovMessage", fov: view.fov, initial: false },
    { type: "SetCameraUpDirectionMessage", position: [0, 1, 0], initial: false },
    { type: "SetCameraPositionMessage", position: standing(view, aspect), initial: false },
    { type: "SetCameraLookAtMessage", look_at: view.target, initial: false },
  ];
}

/**
 * How far the scene is raised: flat for whoever looks from the front, as high as it is for whoever looks from aside.
 *
 * @param {Window["__viserMutable"]} viewer
 * @param {Relief} relief
 */
export function raised(viewer, { flat, full, steps }) {
  if (!viewer?.camera || !viewer.cameraControl) return 0;
  const position = inScene(viewer, viewer.camera.position);
  const target = inScene(viewer, viewer.cameraControl.getTarget(position.clone()));
  const tilt = Math.acos(Math.min(1, (position.z - target.z) / Math.max(position.distanceTo(target), 1e-9)));
  return Math.ceil(Math.min(1, Math.max(0, (tilt - flat) / (full - flat))) * steps) / steps;
}
