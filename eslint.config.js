// The rules for the pages' scripts. Types are checked by tsc; here is what it does not see.

import js from "@eslint/js";

const BROWSER = [
  "AbortController", "AbortSignal", "CanvasRenderingContext2D", "CustomEvent", "DOMParser", "Element", "Event", "EventTarget",
  "FormData", "HTMLElement", "HTMLIFrameElement", "IntersectionObserver", "Image", "KeyboardEvent", "MouseEvent", "MutationObserver", "Node", "OffscreenCanvas",
  "PointerEvent", "ResizeObserver", "TextDecoder", "TextEncoder", "URL", "URLSearchParams", "WebSocket", "XMLHttpRequest",
  "addEventListener", "atob", "btoa", "cancelAnimationFrame", "clearInterval", "clearTimeout", "createImageBitmap", "devicePixelRatio",
  "document", "CSS", "NodeFilter", "Text", "DecompressionStream", "Response",
  "fetch", "getComputedStyle", "history", "innerHeight", "innerWidth", "localStorage", "location", "matchMedia", "navigator",
  "performance", "queueMicrotask", "requestAnimationFrame", "requestIdleCallback", "sessionStorage", "setInterval", "setTimeout", "Path2D", "Blob", "ImageData",
  "DOMException", "File", "MediaRecorder", "MediaStream", "isSecureContext",
];

export default [
  { ignores: ["frontend_static/vendor/"] },
  js.configs.recommended,
  {
    files: ["frontend_static/**/*.js", "server/pftrack_server/**/*.js", "tools/site/static/*.js"],
    languageOptions: { globals: Object.fromEntries(BROWSER.map((name) => [name, "readonly"])) },
    rules: {
      "array-callback-return": "error",
      complexity: ["error", 18],
      "consistent-return": "error",
      curly: ["error", "multi-line"],
      "default-case-last": "error",
      "dot-notation": "error",
      eqeqeq: "error",
      "func-style": ["error", "declaration", { allowArrowFunctions: true }],
      "max-depth": ["error", 3],
      "max-len": ["error", 160],
      "max-lines": ["error", 600],
      "max-lines-per-function": ["error", { max: 50, skipBlankLines: true, skipComments: true }],
      "max-params": ["error", 6],
      "no-console": "error",
      "no-else-return": "error",
      "no-eval": "error",
      "no-implicit-coercion": "error",
      "no-implied-eval": "error",
      "no-lonely-if": "error",
      "no-nested-ternary": "error",
      "no-param-reassign": "error",
      "no-promise-executor-return": "error",
      "no-self-compare": "error",
      "no-sequences": "error",
      "no-shadow": "error",
      "no-template-curly-in-string": "error",
      "no-throw-literal": "error",
      "no-unneeded-ternary": "error",
      "no-unreachable-loop": "error",
      "no-unused-expressions": "error",
      "no-unused-vars": ["error", { ignoreRestSiblings: true }],
      "no-unused-private-class-members": "error",
      "no-useless-concat": "error",
      "no-useless-rename": "error",
      "no-useless-return": "error",
      "no-var": "error",
      "object-shorthand": "error",
      "one-var": ["error", "never"],
      "prefer-arrow-callback": "error",
      "prefer-const": "error",
      "prefer-promise-reject-errors": "error",
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
    // Scripts in the scene's page, each in a function of its own.
    files: ["server/pftrack_server/**/*.js"],
    languageOptions: { globals: { HTMLInputElement: "readonly", dispatchEvent: "readonly", parent: "readonly", window: "readonly" } },
  },
  {
    files: ["tests/pages/**/*.js"],
    languageOptions: { globals: { AbortController: "readonly", Blob: "readonly", clearImmediate: "readonly", setImmediate: "readonly", TextDecoder: "readonly", TextEncoder: "readonly", URL: "readonly", URLSearchParams: "readonly" } },
    rules: { "prefer-const": "error" },
  },
];
