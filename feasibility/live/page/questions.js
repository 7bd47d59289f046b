// Questions to the program, of which only the newest counts.
//
// While something is dragged one question is under way at a time, and what has changed meanwhile is
// asked once its answer is there: no answer waits behind older ones. A question for the certified
// answer goes out at once, and the program gives up the one before it.

const BEAT = 45000; // ms, between two signs of life
const AGAIN = 2000; // ms, after which a question that nobody heard is asked again

async function post(name, asked) {
  const reply = await fetch(name, {
    method: "POST",
    headers: {"Content-Type": "application/json"},
    body: JSON.stringify(asked),
  });
  if (!reply.ok) throw new Error(`${reply.status}`);
  return await reply.json();
}

export class Questions {
  // `heard`: called with an answer and whether a certified one was asked for; `waits`: with what is
  // going on; `broken`: with a sentence when nobody answers, or null when somebody does again.
  constructor({heard, waits, broken}) {
    Object.assign(this, {heard, waits, broken});
    this.session = null;
    this.number = 0;
    this.under_way = false; // a quick question
    this.wanted = null; // the next one
    this.counts = {asked: 0, answered: 0};
    window.addEventListener("pagehide", () => this.leave());
    setInterval(() => this.beat(), BEAT);
  }

  // Ask for the answer to these values.
  ask(values, final) {
    if (final) {
      this.wanted = null;
      this.send(values, true);
    } else if (this.under_way) {
      this.wanted = values;
    } else {
      this.look(values);
    }
  }

  async look(values) {
    this.under_way = true;
    await this.send(values, false);
    this.under_way = false;
    const next = this.wanted;
    this.wanted = null;
    if (next !== null) this.look(next);
  }

  async send(values, final) {
    const number = ++this.number;
    this.counts.asked += 1;
    while (number === this.number) {
      try {
        if (await this.answered(values, number, final)) return;
      } catch (error) {
        if (number !== this.number) return;
        this.broken("nobody answers: the program that serves this page has ended, or cannot be "
          + "reached");
        await new Promise((done) => setTimeout(done, AGAIN));
      }
    }
  }

  // Ask once, and hear the answer; false where it is to be asked again.
  async answered(values, number, final) {
    if (this.session === null && !await this.open()) return true;
    const reply = await post("ask", {session: this.session, number, final, values});
    this.broken(null);
    if (number !== this.number) return true;
    if (reply.status === "gone") {
      this.session = null;
    } else if (reply.status === "deciding") {
      this.waits(reply.said);
    } else if (reply.status === "answered") {
      this.counts.answered += 1;
      this.heard(reply.answer, final);
      return true;
    } else {
      // Given up, since nothing was heard of this page for long: a computer that slept.
      await this.send(values, final);
      return true;
    }
    return false;
  }

  async open() {
    const reply = await post("open", {});
    if (reply.refused) this.broken(reply.refused);
    else this.session = reply.session;
    return !reply.refused;
  }

  async save(values) {
    return await post("save", {values});
  }

  async beat() {
    if (this.session === null) return;
    try {
      const reply = await post("beat", {session: this.session});
      if (reply.status === "gone") this.session = null;
    } catch {
      this.broken("nobody answers: the program that serves this page has ended");
    }
  }

  leave() {
    if (this.session === null) return;
    const text = JSON.stringify({session: this.session});
    navigator.sendBeacon("close", new Blob([text], {type: "application/json"}));
    this.session = null;
  }
}
