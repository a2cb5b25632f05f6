// Texts in the 3-D picture: in the colours of the theme, on a translucent ground that lets the arm
// show through, instead of viser's black on white. Runs before viser compiles its shaders; where
// those read otherwise than expected, nothing changes.
(() => {
  const GROUND = "vec4(1.0, 1.0, 1.0, 0.85 * vAlpha)", INK = "vec4(0.0, 0.0, 0.0, a)";
  const changed = new WeakSet(), places = new WeakMap();
  const gl = WebGL2RenderingContext.prototype;
  const {shaderSource, linkProgram, useProgram} = gl;
  gl.shaderSource = function (shader, text) {
    const own = text.replace(GROUND, "vec4(mix(vec3(1.0), vec3(0.13, 0.145, 0.17), fxDark), 0.45 * vAlpha)")
      .replace(INK, "vec4(mix(vec3(0.08), vec3(0.93), fxDark), a)");
    if (own !== text) changed.add(shader);
    return shaderSource.call(this, shader, own === text
      ? text : own.replace("void main()", "uniform float fxDark;\nvoid main()"));
  };
  gl.linkProgram = function (program) {
    linkProgram.call(this, program);
    if (this.getAttachedShaders(program).some(shader => changed.has(shader))) places.set(program, null);
  };
  gl.useProgram = function (program) {
    useProgram.call(this, program);
    if (!program || !places.has(program)) return;
    if (!places.get(program)) places.set(program, this.getUniformLocation(program, "fxDark"));
    const dark = document.documentElement.getAttribute("data-mantine-color-scheme") === "dark";
    this.uniform1f(places.get(program), Number(dark));
  };
})();
