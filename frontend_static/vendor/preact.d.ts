/** What the pages use of preact, htm and signals, as far as they need to know; their own types are larger than the pages. */

export interface VNode {
  readonly type: unknown;
  readonly props: unknown;
}
export interface Ref<T> {
  current: T;
}
export interface ReadonlySignal<T> {
  readonly value: T;
  /** The value, without depending on it. */
  peek(): T;
}
export interface Signal<T> extends ReadonlySignal<T> {
  value: T;
}
/** What a component may return and an element may hold; a signal becomes text that follows it. */
export type Child = VNode | string | number | boolean | null | undefined | ReadonlySignal<string | number> | readonly Child[];
export type Component<Props> = (props: Props) => Child;

/** A component's props are checked by its type; those of an element in `html` are not. */
export function h<Props extends object>(component: Component<Props>, props: Props & { key?: string | number }, ...children: Child[]): VNode;
/** Elements as they are written in HTML, with `${}` for values, listeners (`onClick`) and what `h` makes of components. */
export function html(strings: TemplateStringsArray, ...values: unknown[]): VNode;
export function render(child: Child, parent: Element): void;
/** When components are drawn again; in the next microtask if not given. */
export const options: { debounceRendering?: (draw: () => void) => void };

export function signal<T>(value: T): Signal<T>;
export function computed<T>(compute: () => T): ReadonlySignal<T>;
/** Runs `act` now and whenever a signal that it reads changes; what `act` returns is run before that. */
export function effect(act: () => void | (() => void)): () => void;
export function batch<T>(act: () => T): T;
export function untracked<T>(act: () => T): T;
export function useSignal<T>(value: T): Signal<T>;
export function useComputed<T>(compute: () => T): ReadonlySignal<T>;
export function useSignalEffect(act: () => void | (() => void)): void;

export function useRef<T>(value: T): Ref<T>;
export function useMemo<T>(compute: () => T, depends: readonly unknown[]): T;
export function useEffect(act: () => void | (() => void), depends?: readonly unknown[]): void;
export function useLayoutEffect(act: () => void | (() => void), depends?: readonly unknown[]): void;
