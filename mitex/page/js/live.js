// A training that goes on: the page asks its server for the newest checkpoint.

const EVERY = 4000; // [ms]

function follow(page, panel) {
  let known = JSON.stringify(page.data.loss);
  const ask = async () => {
    try {
      const news = await (await fetch(page.data.live)).json();
      const loss = JSON.stringify(news.loss);
      if (loss !== known) {
        known = loss;
        page.data.loss = news.loss;
        page.refresh(await unpacked(news.looks));
        panel.drawLoss();
      }
    } catch {
      panel.say("The server has stopped; the page goes on with what it has.");
      return;
    }
    setTimeout(ask, EVERY);
  };
  setTimeout(ask, EVERY);
}
