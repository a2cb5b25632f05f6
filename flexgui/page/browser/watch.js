// Shows a banner while the server does not answer.
(() => {
  if (window.flexguiWatch) return;
  window.flexguiWatch = true;
  const LOST = "The connection is lost. Your work is kept. This page reconnects by itself.";
  const JOIN = "The server was restarted and needs the join code: reload this page.";
  const banner = document.createElement("div");
  banner.setAttribute("role", "alert");
  banner.style.cssText = "position:fixed;top:0;left:0;right:0;z-index:10000;padding:.6rem 1rem;"
    + "text-align:center;font:600 1rem system-ui,sans-serif;color:#fff;background:#b3261e";
  banner.hidden = true;
  document.body.append(banner);
  let failed = 0;
  const show = (text) => { banner.textContent = text; banner.hidden = !text; };
  const ask = async () => {
    try {
      const options = {cache: "no-store", signal: AbortSignal.timeout(5000)};
      const answer = await fetch("/alive", options);
      failed = 0;
      show(answer.status === 401 ? JOIN : "");
    } catch (error) {
      failed += 1;
      if (failed > 1) show(LOST);
    }
    setTimeout(ask, failed ? 1000 : 3000);
  };
  ask();
})();
