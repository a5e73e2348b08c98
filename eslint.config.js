// The rules for the pages' scripts. Types are checked by tsc; here is what it does not see.

import js from "@eslint/js";

const BROWSER = [
  "AbortController", "AbortSignal", "CanvasRenderingContext2D", "CustomEvent", "DOMParser", "Element", "Event", "EventTarget",
  "FormData", "HTMLElement", "HTMLIFrameElement", "IntersectionObserver", "Image", "MouseEvent", "Node", "OffscreenCanvas",
  "PointerEvent", "ResizeObserver", "TextDecoder", "TextEncoder", "URL", "URLSearchParams", "WebSocket", "XMLHttpRequest",
  "addEventListener", "atob", "btoa", "cancelAnimationFrame", "clearInterval", "clearTimeout", "createImageBitmap", "devicePixelRatio",
  "document", "CSS",
  "fetch", "getComputedStyle", "history", "innerHeight", "innerWidth", "localStorage", "location", "matchMedia", "navigator",
  "performance", "requestAnimationFrame", "requestIdleCallback", "setInterval", "setTimeout", "Path2D", "Blob", "ImageData",
];

export default [
  js.configs.recommended,
  {
    files: ["frontend_static/**/*.js"],
    languageOptions: { globals: Object.fromEntries(BROWSER.map((name) => [name, "readonly"])) },
    rules: {
      "array-callback-return": "error",
      "default-case-last": "error",
      eqeqeq: "error",
      "func-style": ["error", "declaration", { allowArrowFunctions: true }],
      "max-lines": ["error", 320],
      "no-console": "error",
      "no-else-return": "error",
      "no-eval": "error",
      "no-implicit-coercion": "error",
      "no-implied-eval": "error",
      "no-self-compare": "error",
      "no-shadow": "error",
      "no-template-curly-in-string": "error",
      "no-throw-literal": "error",
      "no-unneeded-ternary": "error",
      "no-unused-vars": ["error", { ignoreRestSiblings: true }],
      "no-unused-private-class-members": "error",
      "no-useless-rename": "error",
      "no-var": "error",
      "object-shorthand": "error",
      "prefer-const": "error",
      "prefer-template": "error",
      // Text goes into the page as text alone; see shared/dom.js.
      "no-restricted-properties": [
        "error",
        { property: "innerHTML", message: "text may become markup" },
        { property: "outerHTML", message: "text may become markup" },
        { property: "insertAdjacentHTML", message: "text may become markup" },
      ],
    },
  },
  {
    files: ["tests/pages/**/*.js"],
    languageOptions: { globals: { AbortController: "readonly", TextEncoder: "readonly", URLSearchParams: "readonly" } },
    rules: { "prefer-const": "error" },
  },
];
