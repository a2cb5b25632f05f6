// Stores the window's size, the picture's width, the theme, and whether a graphics card draws, for the
// server (layout.py).
(() => {
  const canvas = document.querySelector("canvas[data-engine]");
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const parts = [innerWidth, innerHeight, canvas ? canvas.clientWidth : 0, dark ? "dark" : "light"];
  try {
    const theme = localStorage.getItem("viser-user:flexgui-theme");
    if (theme === "dark" || theme === "light") parts.push(theme);
    if (window.fxGpu === undefined) {
      const gl = document.createElement("canvas").getContext("webgl");
      const named = gl && gl.getExtension("WEBGL_debug_renderer_info");
      const by = named ? gl.getParameter(named.UNMASKED_RENDERER_WEBGL) : "";
      window.fxGpu = by !== "" && !/swiftshader|llvmpipe|softpipe|software|basic render/i.test(by);
      gl?.getExtension("WEBGL_lose_context")?.loseContext();
    }
    const look = localStorage.getItem("viser-user:flexgui-look");
    if (look === "fine" || (look !== "plain" && window.fxGpu)) parts.push("gpu");
    localStorage.setItem("viser-user:flexgui-window", parts.join(" "));
  } catch (error) {}
})();
